"""What pixels see in a float format, held against exact first hits on the scene as it is."""

import numpy as np

STEEP = 8.0
"""Rise of a surface over run, as the camera sees it, above which its depth counts as torn: 83
degrees off the image plane."""


def errors(
    found_triangle: np.ndarray,
    found_t: np.ndarray,
    true_triangle: np.ndarray,
    true_t: np.ndarray,
    edges: np.ndarray,
) -> dict:
    """Figures of an image; -1 is the triangle of a pixel that sees nothing.

    All arrays are images (height, width). Of the result, `wrong` is the share of pixels that see
    another triangle than they should, or one of both none, and `silhouette` and `inside` are its
    two parts: pixels where `edges` is set, and the others. `lost` and `false` are pixels: hits
    that became misses, and misses that became hits. `t_median`, `t_99` (99th percentile) and
    `t_max` are of |t - true t| / true t, over pixels that see the right triangle (None without
    one).
    """
    hit, truly = found_triangle >= 0, true_triangle >= 0
    wrong = found_triangle != true_triangle
    same = hit & ~wrong & (true_t > 0)
    off = np.abs(found_t[same] - true_t[same]) / true_t[same]
    median, high, most = np.quantile(off, [0.5, 0.99, 1.0]).tolist() if len(off) else [None] * 3
    return {
        "pixels": wrong.size,
        "edge_pixels": int(edges.sum()),
        "wrong": float(wrong.mean()),
        "silhouette": float((wrong & edges).mean()),
        "inside": float((wrong & ~edges).mean()),
        "lost": int((truly & ~hit).sum()),
        "false": int((hit & ~truly).sum()),
        "t_median": median,
        "t_99": high,
        "t_max": most,
    }


def silhouettes(triangle: np.ndarray, depth: np.ndarray, pixel: float) -> np.ndarray:
    """Pixels of an image (height, width) at whose edge a surface ends, in exact first hits.

    A pixel is one if the 3 x 3 pixels around it, as far as they are in the image, hold a hit and
    a miss, or hits whose depths differ by more than STEEP times two pixels' width at the nearer.

    Parameters
    ----------
    triangle : (height, width) int
        -1 where nothing is hit.
    depth : (height, width) float64
        Along the camera's axis. It is not looked at where nothing is hit.
    pixel : float
        Width of a pixel at depth 1.
    """
    hit = triangle >= 0
    near = _around(np.where(hit, depth, np.inf), np.inf).min(axis=0)
    far = _around(np.where(hit, depth, -np.inf), -np.inf).max(axis=0)
    some, none = _around(hit, False).any(axis=0), _around(~hit, False).any(axis=0)
    with np.errstate(invalid="ignore"):  # inf - inf, where all around is missed
        torn = far - near > STEEP * 2 * pixel * near
    return some & (none | torn)


def _around(image: np.ndarray, outside) -> np.ndarray:
    """The image (9, height, width), moved by a pixel each way and not at all."""
    padded = np.pad(image, 1, constant_values=outside)
    height, width = image.shape
    return np.stack([padded[y : y + height, x : x + width] for y in range(3) for x in range(3)])
