"""Model of hdl.rays.setup: what of a ray is computed once, before it meets a node."""

import numpy as np
from numba import njit

from hdl.fp.format import FloatFormat
from hdl.rays.packet import MARGIN_ULPS
from sim.model.fp.add import add_bits
from sim.model.fp.format import encode
from sim.model.fp.mul import mul_bits
from sim.model.fp.recip import recip_bits
from sim.model.fp.round import DOWN, NEAREST, UP, overflow_bits
from sim.model.rays.overflow import SETUP, no_overflows

# A row of `setup`: columns of three axes each, then the shear.
ORIGIN, ABOVE, BELOW, INVERSE_DOWN, INVERSE_UP, NEGATIVE = range(0, 18, 3)
AXIS_Z, SHEAR_X, SHEAR_Y, SHEAR_Z = range(18, 22)
COLUMNS = 22

ROUNDING_ULPS = 18
"""Half ulps of the largest distance by which the triangle test's rounding moves a point on an axis.

The distance is that between the ray's origin and the scene, on an axis. 8 come from the sheared
vertices, 10 from t: where the test finds a hit, the exact ray passes the exact triangle this near.
"""


def margin_scale(fmt: FloatFormat) -> int:
    """Pattern of the margin at distance 1: MARGIN_ULPS half ulps."""
    return int(encode(fmt, MARGIN_ULPS * 2.0 ** -(fmt.man_bits + 1)))


def one(fmt: FloatFormat) -> int:
    """Pattern of 1."""
    return int(encode(fmt, 1.0))


@njit(cache=True)
def setup_bits(exp_bits, man_bits, one, scale, origin, direction, row, overflows):
    """Fill a row for a ray: `origin` and `direction` are patterns of three axes.

    margin = scale * (1 + largest |origin|), rounded up twice.
    above, below = origin + margin up, origin - margin down: for lower and for upper planes.
    inverses of each direction down and up.
    z is the axis of the largest |direction|, the first of equal ones; x and y follow it.
    shear z = inverse down of z; shear x and y = direction * shear z, to nearest.
    Sets its flag of `overflows`.
    """
    sign = 1 << (exp_bits + man_bits)
    largest = 0
    for axis in range(3):
        largest = max(largest, origin[axis] & (sign - 1))
    reach = add_bits(exp_bits, man_bits, UP, one, largest)
    margin = mul_bits(exp_bits, man_bits, UP, scale, reach)
    infinite = overflow_bits(exp_bits, man_bits, reach, one, largest)
    infinite |= overflow_bits(exp_bits, man_bits, margin, scale, reach)
    z = 0
    for axis in range(3):
        row[ORIGIN + axis] = origin[axis]
        row[ABOVE + axis] = add_bits(exp_bits, man_bits, UP, origin[axis], margin)
        row[BELOW + axis] = add_bits(exp_bits, man_bits, DOWN, origin[axis], margin | sign)
        for column in (ABOVE, BELOW):
            infinite |= overflow_bits(exp_bits, man_bits, row[column + axis], origin[axis], margin)
        row[INVERSE_DOWN + axis] = recip_bits(exp_bits, man_bits, DOWN, direction[axis])
        row[INVERSE_UP + axis] = recip_bits(exp_bits, man_bits, UP, direction[axis])
        row[NEGATIVE + axis] = 1 if direction[axis] & sign else 0
        if direction[axis] & (sign - 1) > direction[z] & (sign - 1):
            z = axis
    row[AXIS_Z] = z
    row[SHEAR_Z] = row[INVERSE_DOWN + z]
    for column, axis in ((SHEAR_X, (z + 1) % 3), (SHEAR_Y, (z + 2) % 3)):
        row[column] = mul_bits(exp_bits, man_bits, NEAREST, direction[axis], row[SHEAR_Z])
        infinite |= overflow_bits(exp_bits, man_bits, row[column], direction[axis], row[SHEAR_Z])
    overflows[SETUP] |= infinite


@njit(cache=True)
def _setup(exp_bits, man_bits, one, scale, origins, directions):
    rows = np.empty((len(origins), COLUMNS), np.int64)
    overflows = no_overflows()
    for ray in range(len(origins)):
        setup_bits(
            exp_bits, man_bits, one, scale, origins[ray], directions[ray], rows[ray], overflows
        )
    return rows


def setup(
    fmt: FloatFormat, origins: np.ndarray, directions: np.ndarray, margin: int | None = None
) -> np.ndarray:
    """Rows (n, COLUMNS) of rays with origins and directions (n, 3), all bit patterns int64.

    `margin` is as in sim.model.rays.traversal.trace.
    """
    scale = margin_scale(fmt) if margin is None else margin
    return _setup(fmt.exp_bits, fmt.man_bits, one(fmt), scale, origins, directions)
