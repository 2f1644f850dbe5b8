"""First hits of rays on triangles, in float64 with exact decisions."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from sim.oracle.bvh import build
from sim.oracle.inputs import check_rays, corners_of
from sim.oracle.intersect import intersect

SLACK = 1e-11
"""Share by which t of a box is widened: more than t of a hit and of a plane can be off."""


@dataclass(frozen=True)
class Truth:
    """First hits.

    Attributes
    ----------
    t : (n,) float64
        In directions; inf where nothing is hit.
    triangle : (n,) int64
        -1 where nothing is hit.
    """

    t: np.ndarray
    triangle: np.ndarray


def trace(
    vertices: np.ndarray,
    faces: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    t_min: np.ndarray,
    t_max: np.ndarray,
) -> Truth:
    """First hit of each ray with t_min <= t <= t_max; of equal t that of the lower triangle.

    A ray hits a triangle, from either side, if the three edge functions (a - o) x (b - o) . d
    have no two opposite signs and are not all zero: edges and vertices count, a triangle seen
    edge-on or without area does not. Their signs are exact, so closed meshes have no holes. t is
    rounded, to a relative 1e-12: hits whose t differ by less may change places, and a hit as close
    to t_min or t_max may be in or out.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (T, 3) int
    origins, directions : (n, 3) float64
        Directions have any length; one that is all zero hits nothing.
    t_min, t_max : (n,) float64
        May be infinite. A ray with t_min above t_max is not there and hits nothing.

    Raises
    ------
    ValueError
        Shapes do not fit, a face names no vertex, or a coordinate is not finite.
    """
    corners = corners_of(vertices, faces)
    rays = check_rays(origins, directions, t_min, t_max)
    t = np.full(len(rays[0]), np.inf)
    triangle = np.full(len(rays[0]), -1, np.int64)
    if len(corners):
        bvh = build(corners)
        # In the order of the leaves, so that what is tested together lies together.
        _trace(bvh.boxes, bvh.links, bvh.triangles, corners[bvh.triangles], *rays, t, triangle)
    return Truth(t, triangle)


@njit(cache=True)
def _enter(box, origin, direction, inverse, near, far):
    """First t in [near, far] in a box, no later than it is; inf where the ray misses the box."""
    for axis in range(3):
        if direction[axis] == 0.0:
            if not box[axis] <= origin[axis] <= box[axis + 3]:
                return np.inf
            continue
        first = (box[axis] - origin[axis]) * inverse[axis]
        last = (box[axis + 3] - origin[axis]) * inverse[axis]
        if direction[axis] < 0.0:
            first, last = last, first
        near = max(near, first - SLACK * abs(first))
        far = min(far, last + SLACK * abs(last))
    return near if near <= far else np.inf


@njit(cache=True)
def _trace(boxes, links, triangles, corners, origins, directions, t_min, t_max, t, triangle):
    zero, inverse = np.zeros(3), np.empty(3)
    waiting, waiting_t = np.empty(64, np.int64), np.empty(64)
    for ray in range(len(origins)):
        origin, direction = origins[ray], directions[ray]
        if not t_min[ray] <= t_max[ray]:
            continue
        for axis in range(3):
            inverse[axis] = 1.0 / direction[axis] if direction[axis] != 0.0 else 0.0
        best, best_triangle = t_max[ray], len(corners)
        depth = 1
        waiting[0], waiting_t[0] = 0, t_min[ray]
        while depth:
            depth -= 1
            node = waiting[depth]
            if waiting_t[depth] > best + SLACK * abs(best):
                continue
            begin, count = links[node]
            if count:
                for k in range(begin, begin + count):
                    hit = intersect(
                        corners[k, 0], corners[k, 1], corners[k, 2], origin, direction, zero
                    )
                    if t_min[ray] <= hit and (
                        hit < best or (hit == best and triangles[k] < best_triangle)
                    ):
                        best, best_triangle = hit, triangles[k]
                continue
            left, right = node + 1, begin
            reach = best + SLACK * abs(best)
            left_t = _enter(boxes[left], origin, direction, inverse, t_min[ray], reach)
            right_t = _enter(boxes[right], origin, direction, inverse, t_min[ray], reach)
            if left_t < right_t:  # the nearer one goes on top
                left, right, left_t, right_t = right, left, right_t, left_t
            if left_t < np.inf:
                waiting[depth], waiting_t[depth] = left, left_t
                depth += 1
            if right_t < np.inf:
                waiting[depth], waiting_t[depth] = right, right_t
                depth += 1
        if best_triangle < len(corners):
            t[ray], triangle[ray] = best, best_triangle
