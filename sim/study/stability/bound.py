r"""How far from an edge, at most, a ray passes whose decision the machine rounds away.

The triangle test (sim.model.rays.triangle) rounds only on the way to the sheared corners: the
signs of the edge functions are exact for those. So it decides exactly, for corners that lie
somewhere else. How far, on each of the axes x and y of the sheared space? Let u be half an ulp of
1, 2^-(man_bits + 1); a rounding to nearest has a relative error of u / (1 + u) at most, one in a
given direction 2u. Let R be the reach, the largest distance of origin and corners on an axis, and
k = d_x / d_z the shear; |k| <= 1, as z is the axis of the largest direction.

=== =============================== ==================================================== =====
 .  step                            error, at most                                       in uR
=== =============================== ==================================================== =====
1   a_x = corner_x - origin_x       u R                                                  1
2   S = 1 / d_z, rounded down       2u of itself
3   k = d_x S                       u more: 3u in all; |k| <= 1 still, as |d_x| S <= 1
4   a_z = corner_z - origin_z       u R
5   k a_z, before it is rounded     3u R of k, u R of a_z
6   s = k a_z                       5 with u of its own                                  5
7   a_x - s                         u of itself, and |a_x - s| <= 2R                     2
=== =============================== ==================================================== =====

8 u R in all, and less than u times uR of second order. A number that underflows moves by up to the
smallest normal, m: in steps 1, 4, 6 and 7 by m, in step 3 by m times R.

Moving the corners by this B on x and on y moves them by sqrt(2) B in space. Where that changes a
decision, an edge sweeps over the ray on its way, so the ray passes an edge of the exact triangle
within sqrt(2) B. What t >= 0 decides is not in question here: the test's t lies between those of
the corners, up to rounding, and the study keeps all corners well in front of the origin.

A hit's t adds 10 uR (sim.model.rays.setup.ROUNDING_ULPS): products e z 1, their sum 2, the area 2,
its reciprocal 1, the product with it 1, the edge functions e 1, a_z 1 and z = S a_z 1. The 2 of S
are counted above: what S takes from t it takes from k too, and the two cancel on x and y.
"""

import numpy as np

from hdl.fp.format import FloatFormat
from sim.oracle.distance import line_outline

HALF_ULPS = 8
"""Of the reach: what the sheared corners are off on an axis."""


def sheared(fmt: FloatFormat, reach: float) -> float:
    """B: the bound on each sheared axis, in the unit of `reach`."""
    u, smallest = 2.0 ** -(fmt.man_bits + 1), 2.0**fmt.min_exp
    return (HALF_ULPS + u) * u * reach + (4 + reach) * smallest


def share(
    fmt: FloatFormat, corners: np.ndarray, origin: np.ndarray, direction: np.ndarray
) -> float:
    """Distance of a ray from the nearest edge of a triangle (3, 3), over the bound."""
    reach = float(np.abs(corners - origin).max())
    return line_outline(origin, direction, *corners) / (np.sqrt(2) * sheared(fmt, reach))
