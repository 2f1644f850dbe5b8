"""Which pieces stay beside each other."""

import numpy as np

from sim.parts.pieces import pieces


def adjacent(low: np.ndarray, high: np.ndarray, large: np.ndarray) -> np.ndarray:
    """Group (K,) of each piece, from 0: adjacent geometry that stays adjacent is one part.

    The boxes of two pieces of one group meet in all poses, or those of pieces between them do; as
    those of a head, its eyes and its teeth. All that is small and beside nothing is one group.

    Parameters
    ----------
    low, high : (S, K, 3) float64
        Boxes in each pose.
    large : (K,) bool
        Of two pieces one has to be large: small ones by the thousand may be beside each other by
        chance.
    """
    count = low.shape[1]
    links = [np.stack([np.arange(count)] * 2, axis=1)]
    alone = ~large
    for piece in np.flatnonzero(large):
        beside = np.arange(count)
        for lows, highs in zip(low, high, strict=True):
            meets = (lows[beside] <= highs[piece]) & (highs[beside] >= lows[piece])
            beside = beside[meets.all(axis=1)]
        alone[beside] = False
        links.append(np.stack([np.full(len(beside), piece), beside], axis=1))
    small = np.flatnonzero(alone)
    links.append(np.stack([np.full(len(small), small[0] if len(small) else 0), small], axis=1))
    joined = np.concatenate(links)
    return pieces(joined[:, [0, 1, 1]], count)[:count]
