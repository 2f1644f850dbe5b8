"""The part of a view that fills an image."""

import numpy as np

STEP = 0.94
"""Each crop that is tried is that much smaller than the last."""


def crop(
    covered: np.ndarray, shown: np.ndarray, window: np.ndarray, aspect: float, fill: float
) -> tuple[np.ndarray, float, float]:
    """The crop of a window that an object fills and that shows most; of equals the largest.

    Crops shrink from one that holds the whole window. If none is ever filled, it is the fullest,
    of equals the smallest.

    Parameters
    ----------
    covered : (rows, columns) bool
        Cells of the window in which the object is; none of it is outside.
    shown : (rows, columns) float64
        What each cell is worth.
    window : (4,) float64
        Left, top, right, bottom.
    aspect : float
        Width by height of the crop.
    fill : float
        Share of it to cover.

    Returns
    -------
    crop : (4,) float64
        As window. Where it is narrower than a cell it stands for the whole of that.
    share : float
        Of it that is covered.
    worth : float
        What it shows.
    """
    rows, columns = covered.shape
    size = window[2:] - window[:2]
    cell = size / (columns, rows)
    sums = [_sums(covered), _sums(shown)]
    height = max(size[1], size[0] / aspect)
    best, fullest = (window, 0.0, -1.0), (window, -1.0, 0.0)  # crop, share, worth
    while True:
        extent = np.array([height * aspect, height])
        wide, high = (max(1, round(x)) for x in (extent / cell).tolist())
        height *= STEP
        if wide * high * fill > max(sums[0][-1, -1], 1):  # there is not as much to fill it with
            continue
        if best[2] >= wide * high * shown.max():  # no smaller crop shows as much
            return best
        shares, worths = (_boxes(table, wide, high) for table in sums)
        shares /= wide * high
        filled = np.where(shares >= fill, worths, -1.0)
        found = filled.max() >= 0
        place = int(filled.argmax() if found else shares.argmax())
        share, worth = float(shares.flat[place]), float(worths.flat[place])
        y, x = divmod(place, shares.shape[1])
        middle = window[:2] + cell * (_middle(x, wide, columns), _middle(y, high, rows))
        chosen = (np.concatenate([middle - extent / 2, middle + extent / 2]), share, worth)
        if found and worth > best[2]:
            best = chosen
        if share >= fullest[1]:
            fullest = chosen
        if wide == 1 and high == 1:
            return best if best[2] >= 0 else fullest


def _sums(cells: np.ndarray) -> np.ndarray:
    """Sums of all cells above and left of each corner."""
    table = np.zeros((cells.shape[0] + 1, cells.shape[1] + 1))
    table[1:, 1:] = cells.cumsum(axis=0, dtype=np.float64).cumsum(axis=1)
    return table


def _boxes(table: np.ndarray, wide: int, high: int) -> np.ndarray:
    """Sums in all boxes of a size, or as much of it as there is."""
    wide, high = min(wide, table.shape[1] - 1), min(high, table.shape[0] - 1)
    rows = table[high:] - table[:-high]
    return rows[:, wide:] - rows[:, :-wide]


def _middle(place: int, extent: int, cells: int) -> float:
    """Of a box that begins at a cell; one that is wider than all cells is centred on them."""
    return cells / 2 if extent >= cells else place + extent / 2
