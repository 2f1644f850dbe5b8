"""How far rounding must have moved surfaces to explain a hit that is not the oracle's.

A machine that rounds sees every triangle with its corners somewhere else, up to some distance
from where they are, and otherwise decides rightly. Two statements follow for the exact ray and
the exact triangle, whatever the angle between them:

- The machine finds a hit at t in a triangle: the ray's point at t is within that distance of the
  triangle, as a piece of surface with its edges. Face-on, t can be off by that distance; at an
  angle of incidence by that over its cosine; past an edge, by less. A grazing ray may run along
  the triangle at this distance for long, and no hit on this part of it is wrong.
- The machine misses a triangle that the ray hits: while the corners move there, an edge sweeps
  over the ray, so the line of the ray passes an edge within that distance. It is the line that
  counts and not the ray between t_min and t_max, since which side of an edge a line passes does
  not depend on t. Of a triangle seen almost edge-on, all points are this near to the outline:
  such a triangle may be missed anywhere.

If the machine does not miss it, it finds it at a t that it did not want: outside of
[t_min, t_max], or behind the hit that it reports. The ray's points within the distance of a
triangle are one piece, since a triangle is convex. So if that t lies beyond t_min, t_max or the
reported t, seen from the oracle's, the ray's point at that end is within the distance too.
"""

import numpy as np
from numba import njit

from sim.oracle.distance import line_outline, point_triangle


@njit(cache=True)
def _at(t, origin, direction, corners):
    """Distance of the ray's point at t and a triangle; inf where t is not finite."""
    if not np.isfinite(t):
        return np.inf
    return point_triangle(origin + t * direction, corners[0], corners[1], corners[2])


@njit(cache=True)
def movements(corners, origins, directions, limits, found_t, found, true_t, true):
    """Distance (n,) by which surfaces must have moved; inf where no distance explains it.

    Parameters
    ----------
    corners : (T, 3, 3) float64
    origins, directions : (n, 3) float64
    limits : (n, 2) float64
        t_min and t_max.
    found_t, true_t : (n,) float64
    found, true : (n,) int64
        Triangles of the machine and of the oracle, -1 for none.
    """
    moved = np.zeros(len(found))
    for ray in range(len(found)):
        origin, direction = origins[ray], directions[ray]
        t_min, t_max = limits[ray]
        if found[ray] >= 0:  # is its hit one?
            if t_min <= found_t[ray] <= t_max:
                moved[ray] = _at(found_t[ray], origin, direction, corners[found[ray]])
            else:
                moved[ray] = np.inf
        nearer = found[ray] >= 0 and found_t[ray] < true_t[ray]
        if true[ray] >= 0 and true[ray] != found[ray] and not nearer:  # could it lose the oracle's?
            triangle = corners[true[ray]]
            lost = line_outline(origin, direction, triangle[0], triangle[1], triangle[2])
            lost = min(lost, _at(t_min, origin, direction, triangle))
            lost = min(lost, _at(t_max, origin, direction, triangle))
            if found[ray] >= 0:
                lost = min(lost, _at(found_t[ray], origin, direction, triangle))
            moved[ray] = max(moved[ray], lost)
    return moved
