"""Model of hdl.rays.transform: rays taken into the frame of an instance's object.

By how much they are off. Half an ulp u is 2 ** -(man_bits + 1), |x| the largest magnitude of a
coordinate, |M| the norm of the 3 x 3 matrix (largest row sum of magnitudes), c the offset. In the
first order, and if nothing falls below the smallest number, each coordinate of

- the origin o is off by 4 |M| |o| + |c| half ulps: two roundings of the first two products' sum,
  three of the third's, four at most of any product, one of the offset;
- the direction d by 3 |M| |d| half ulps: adding 0 does not round;
- the point at t so by 4 |M| |o| + 3 |M| |t d| + |c|.

Where a ray hits within the object, the triangle test adds ROUNDING_ULPS (sim.model.rays.setup)
times the distance of the object, 1 + |M| |o| + |c| at most. If coordinates of world and object are
within [-1, 1], then |t d| <= 1 + |o| and |c| <= 1 + |M|; all together 25 |M| |o| + 22 |M| + 37, and
so (1 + |o|) (25 |M| + 37). What is off by that in the object is off by |M^-1| times as much in the
world. hdl.rays.packet.INSTANCE_ULPS has some room for what is of higher order.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from sim.model.fp.add import add_bits
from sim.model.fp.mul import mul_bits
from sim.model.fp.round import NEAREST, overflow_bits
from sim.model.rays.overflow import TRANSFORM


@dataclass(frozen=True)
class Instances:
    """Leaves that are instances of objects.

    Attributes
    ----------
    of_leaf : (L,) int64
        The instance of each leaf, or -1 where it is a triangle.
    rows : (K, 3, 4) int64 bit patterns
        Of each instance x, y, z and offset of its three rows: from the world to the object.
    roots : (K,) int64
        The node at the root of each instance's object.
    """

    of_leaf: np.ndarray
    rows: np.ndarray
    roots: np.ndarray


def no_instances(leaves: int) -> Instances:
    """Every leaf is a triangle."""
    none = np.zeros(0, np.int64)
    return Instances(np.full(leaves, -1, np.int64), none.reshape(0, 3, 4), none)


@njit(cache=True)
def transform_bits(exp_bits, man_bits, rows, origin, direction, to_origin, to_direction, overflows):
    """Fill origin and direction (3,) of a ray in the frame of an instance of `rows` (3, 4).

    Coordinate k is ((x * px + y * py) + z * pz) + offset of row k, each operation rounded to
    nearest; that of a direction has +0 for the offset. Sets its flag of `overflows`.
    """
    infinite = False
    for k in range(3):
        row = rows[k]
        for part in range(2):
            point = direction if part else origin
            total = mul_bits(exp_bits, man_bits, NEAREST, row[0], point[0])
            infinite |= overflow_bits(exp_bits, man_bits, total, row[0], point[0])
            for axis in range(1, 3):
                product = mul_bits(exp_bits, man_bits, NEAREST, row[axis], point[axis])
                infinite |= overflow_bits(exp_bits, man_bits, product, row[axis], point[axis])
                before = total
                total = add_bits(exp_bits, man_bits, NEAREST, before, product)
                infinite |= overflow_bits(exp_bits, man_bits, total, before, product)
            before, offset = total, 0 * row[3] if part else row[3]
            total = add_bits(exp_bits, man_bits, NEAREST, before, offset)
            infinite |= overflow_bits(exp_bits, man_bits, total, before, offset)
            if part:
                to_direction[k] = total
            else:
                to_origin[k] = total
    overflows[TRANSFORM] |= infinite
