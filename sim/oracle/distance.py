"""Distances in space between rays and what triangles are made of.

Points and vectors are (3,) float64; distances are Euclidean and in the unit of the coordinates.
"""

import numpy as np
from numba import njit

THIN = 1e-9
"""Height of a triangle over its length below which it is taken for its three edges."""


@njit(cache=True)
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def _cross(a, b):
    return np.array((
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ))


@njit(cache=True)
def point_segment(p, a, b):
    """Distance of a point and the segment from a to b, which may be a point."""
    along, to_p = b - a, p - a
    square = _dot(along, along)
    share = min(max(_dot(to_p, along) / square, 0.0), 1.0) if square > 0.0 else 0.0
    rest = to_p - share * along
    return np.sqrt(_dot(rest, rest))


@njit(cache=True)
def point_triangle(p, a, b, c):
    """Distance of a point and a triangle, which may have no area."""
    distance = min(point_segment(p, a, b), point_segment(p, b, c), point_segment(p, c, a))
    normal = _cross(b - a, c - a)
    square = _dot(normal, normal)
    longest = max(_dot(b - a, b - a), _dot(c - b, c - b), _dot(a - c, a - c))
    if square <= (THIN * longest) ** 2:
        return distance
    for start, end in ((a, b), (b, c), (c, a)):
        if _dot(_cross(end - start, p - start), normal) < 0.0:  # not above the inside
            return distance
    return min(distance, abs(_dot(p - a, normal)) / np.sqrt(square))


@njit(cache=True)
def line_outline(origin, direction, a, b, c):
    """Distance of a line and the outline of a triangle: of its edges, the nearest one.

    That is the distance of the edges and the origin after all is projected along the direction.
    A direction that is all zero makes the line a point.
    """
    square = _dot(direction, direction)
    flat = np.empty((3, 3))
    flat[0], flat[1], flat[2] = a - origin, b - origin, c - origin
    if square > 0.0:
        for k in range(3):
            flat[k] -= _dot(flat[k], direction) / square * direction
    zero = np.zeros(3)
    return min(
        point_segment(zero, flat[0], flat[1]),
        point_segment(zero, flat[1], flat[2]),
        point_segment(zero, flat[2], flat[0]),
    )
