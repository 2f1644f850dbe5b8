"""Where a ray meets a triangle, in float64 with exact decisions."""

import numpy as np
from numba import njit

from sim.oracle.exact import ERROR, determinant, rounded

CANCELLED = 1e-3
"""A determinant below this share of its magnitude is computed again, without rounding.

The numbers that t is made of are so right to ERROR / CANCELLED.
"""


@njit(cache=True)
def _minus(p, q):
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@njit(cache=True)
def intersect(a, b, c, origin, direction, zero):
    """Where a ray hits a triangle, in directions; NaN where it misses."""
    d = (direction[0], direction[1], direction[2])
    to_a, to_b, to_c = _minus(a, origin), _minus(b, origin), _minus(c, origin)
    bc, size = rounded(to_b, to_c, d)
    if abs(bc) <= ERROR * size:
        bc = determinant(b, origin, c, origin, direction, zero)
    ca, size = rounded(to_c, to_a, d)
    if abs(ca) <= ERROR * size:
        ca = determinant(c, origin, a, origin, direction, zero)
    if min(bc, ca) < 0.0 < max(bc, ca):
        return np.nan
    ab, size = rounded(to_a, to_b, d)
    if abs(ab) <= ERROR * size:
        ab = determinant(a, origin, b, origin, direction, zero)
    if min(bc, ca, ab) < 0.0 < max(bc, ca, ab) or bc == ca == ab == 0.0:
        return np.nan

    # Both over twice the area: how far the plane is along its normal, and how fast the ray goes.
    side, other = _minus(b, a), _minus(c, a)
    distance, size = rounded(side, other, to_a)
    if abs(distance) <= CANCELLED * size:
        distance = determinant(b, a, c, a, a, origin)
    speed, size = rounded(side, other, d)
    if abs(speed) <= CANCELLED * size:
        speed = determinant(b, a, c, a, direction, zero)
    return distance / speed + 0.0  # -0 is where +0 is
