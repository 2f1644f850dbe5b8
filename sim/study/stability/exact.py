"""Whether a ray hits a triangle, in integers: nothing is rounded.

Shares no code with sim.oracle, which decides the same by expansions of float64.
"""

import numpy as np

Vector = tuple[int, int, int]


def integers(numbers: np.ndarray) -> list[Vector]:
    """Finite float64 (n, 3), all times one power of two that leaves no fraction."""
    ratios = [x.as_integer_ratio() for x in np.asarray(numbers, np.float64).ravel().tolist()]
    most = max(below for _, below in ratios)
    scaled = [above * (most // below) for above, below in ratios]
    return list(zip(*[iter(scaled)] * 3, strict=True))


def determinant(a: Vector, b: Vector, c: Vector) -> int:
    """(a x b) . c."""
    return (
        (a[1] * b[2] - a[2] * b[1]) * c[0]
        + (a[2] * b[0] - a[0] * b[2]) * c[1]
        + (a[0] * b[1] - a[1] * b[0]) * c[2]
    )


def hits(corners: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> bool:
    """A ray, t >= 0, hits a triangle (3, 3) from either side, its edges and corners included.

    A triangle seen edge-on or without area is no hit, and a direction of zero hits nothing.
    """
    *points, (x, y, z) = integers(np.vstack([corners, origin]))
    a, b, c = ((point[0] - x, point[1] - y, point[2] - z) for point in points)
    (d,) = integers(direction[None])
    edges = determinant(b, c, d), determinant(c, a, d), determinant(a, b, d)
    if min(edges) < 0 < max(edges) or not any(edges):
        return False
    # t is the volume of the triangle and the origin over the sum of the edge functions.
    return determinant(a, b, c) * sum(edges) >= 0
