"""Model of hdl.rays.transform: rays of the world into the frame of an object."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from hdl.fp.format import FloatFormat
from sim.compiler.image import Image
from sim.model.fp.add import add_bits
from sim.model.fp.mul import mul_bits
from sim.model.fp.round import NEAREST, overflow_bits
from sim.model.rays.overflow import TRANSFORM, no_overflows


@dataclass(frozen=True)
class Instances:
    """Leaves of a tree that are instances of objects.

    Attributes
    ----------
    leaves : (L,) int64
        For each leaf of all trees its instance, -1 if it is a triangle.
    roots : (I,) int64
        The root of the tree of each instance's object.
    rows : (I, 3, 4) int64
        Patterns of the matrix that takes points of the world into the object's frame.
    """

    leaves: np.ndarray
    roots: np.ndarray
    rows: np.ndarray


def instances_of(image: Image, rows: np.ndarray) -> Instances:
    """Those of an image, with rows (I, 3, 4)."""
    leaves = np.full(len(image.corners), -1, np.int64)
    leaves[image.instances.leaves] = np.arange(len(rows))
    return Instances(leaves, image.instances.roots.astype(np.int64), rows)


def no_instances(leaves: int) -> Instances:
    """Where all leaves are triangles."""
    none = np.zeros(0, np.int64)
    return Instances(np.full(leaves, -1, np.int64), none, np.zeros((0, 3, 4), np.int64))


@njit(cache=True)
def _coordinate_bits(exp_bits, man_bits, row, vector, offset, overflows):
    """((x * vx + y * vy) + z * vz) + offset, of a row (x, y, z, its offset)."""
    infinite = False
    value = 0
    for k in range(3):
        product = mul_bits(exp_bits, man_bits, NEAREST, row[k], vector[k])
        infinite |= overflow_bits(exp_bits, man_bits, product, row[k], vector[k])
        if k == 0:
            value = product
            continue
        total = add_bits(exp_bits, man_bits, NEAREST, value, product)
        infinite |= overflow_bits(exp_bits, man_bits, total, value, product)
        value = total
    total = add_bits(exp_bits, man_bits, NEAREST, value, offset)
    overflows[TRANSFORM] |= infinite | overflow_bits(exp_bits, man_bits, total, value, offset)
    return total


@njit(cache=True)
def transform_bits(exp_bits, man_bits, rows, origin, direction, to_origin, to_direction, overflows):
    """Fill a ray (origin and direction of three axes) with one as rows (3, 4) see it.

    The direction has no offset. Each operation is rounded to nearest. Sets its flag of `overflows`.
    """
    for axis in range(3):
        row = rows[axis]
        to_origin[axis] = _coordinate_bits(exp_bits, man_bits, row, origin, row[3], overflows)
        to_direction[axis] = _coordinate_bits(exp_bits, man_bits, row, direction, 0, overflows)


def transform(
    fmt: FloatFormat, rows: np.ndarray, origins: np.ndarray, directions: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions (n, 3) as rows (3, 4) see them; all bit patterns int64."""
    to_origins, to_directions = np.empty_like(origins), np.empty_like(directions)
    for k in range(len(origins)):
        transform_bits(
            fmt.exp_bits,
            fmt.man_bits,
            rows,
            origins[k],
            directions[k],
            to_origins[k],
            to_directions[k],
            no_overflows(),
        )
    return to_origins, to_directions
