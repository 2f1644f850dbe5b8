"""Normals that follow the surface a mesh stands for: smooth, but for its creases."""

import numpy as np
from numba import njit

from sim.report.seen import Seen, unit

CREASE = 62.0
"""Degrees between triangles that meet from which there is an edge, and not a curve."""
MOST = 64
"""Triangles at a vertex that count, about; of more, such as at the tip of a cone, every so many."""


def smooth_normals(seen: Seen) -> np.ndarray:
    """Unit normals (n, 3) of the hits, on the side of the camera.

    Interpolated between normals of the triangle's corners. That of a corner is the mean over all
    triangles at the vertex that are no more than CREASE off this one, whatever their winding.
    """
    shown, row = np.unique(seen.triangle[seen.hit], return_inverse=True)
    a, b, c = np.moveaxis(seen.vertices[seen.faces], 1, 0)
    flat = unit(np.cross(b - a, c - a))
    angles = np.stack([_angle(b - a, c - a), _angle(c - b, a - b), _angle(a - c, b - c)], axis=1)
    corners = seen.faces.ravel()
    around = np.argsort(corners, kind="stable")  # corners by their vertices
    first = np.concatenate([[0], np.bincount(corners, minlength=len(seen.vertices)).cumsum()])
    limit = np.cos(np.radians(CREASE))
    means = _means(shown, seen.faces, flat, angles.ravel(), around, first, limit)
    smooth = unit((seen.weights[:, :, None] * means[row]).sum(axis=1))
    # by the triangle, not by itself: at the rim of a ball it may well point away a little
    side = (flat[shown[row]] * seen.flat_normals).sum(axis=1, keepdims=True)
    return np.where(side < 0, -smooth, smooth)


def _angle(one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Radians between vectors (n, 3)."""
    return np.arccos(np.clip((unit(one) * unit(two)).sum(axis=1), -1, 1))


@njit(cache=True)
def _means(shown, faces, flat, angles, around, first, limit):
    """Normals (n, 3, 3) at the corners of the shown triangles, weighted by angles."""
    means = np.zeros((len(shown), 3, 3))
    for row in range(len(shown)):
        own = flat[shown[row]]
        for k in range(3):
            vertex = faces[shown[row], k]
            begin, end = first[vertex], first[vertex + 1]
            for place in range(begin, end, 1 + (end - begin) // MOST):
                other = flat[around[place] // 3]
                cosine = own[0] * other[0] + own[1] * other[1] + own[2] * other[2]
                if abs(cosine) >= limit:
                    weight = np.copysign(angles[around[place]], cosine)
                    means[row, k] += weight * other
            means[row, k] += 1e-9 * own  # if every other one is left out
    return means
