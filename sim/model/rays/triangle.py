"""Model of hdl.rays.triangle: the watertight ray-triangle test."""

import numpy as np
from numba import njit

from sim.model.fp.add import add_bits
from sim.model.fp.cross import cross_bits
from sim.model.fp.mul import mul_bits
from sim.model.fp.recip import recip_bits
from sim.model.fp.round import (
    NEAREST,
    exponent_bits,
    infinity_bits,
    overflow_bits,
    pack_bits,
)
from sim.model.rays.overflow import TRIANGLES
from sim.model.rays.setup import AXIS_Z, ORIGIN, SHEAR_X, SHEAR_Y, SHEAR_Z


@njit(cache=True)
def widen_bits(exp_bits, man_bits, x):
    """Pattern in the format of differences, of two exponent bits more: exact."""
    exponent = exponent_bits(exp_bits, man_bits, x)
    sign = x >> (exp_bits + man_bits)
    if exponent == 0:
        return pack_bits(exp_bits + 2, man_bits, sign, 0)
    if exponent == (1 << exp_bits) - 1:
        return infinity_bits(exp_bits + 2, man_bits, sign)
    exponent += (1 << (exp_bits + 1)) - (1 << (exp_bits - 1))
    mantissa = x & ((1 << man_bits) - 1)
    return pack_bits(exp_bits + 2, man_bits, sign, (exponent << man_bits) | mantissa)


@njit(cache=True)
def narrow_bits(exp_bits, man_bits, x):
    """Pattern of a number in the format of differences: infinity or zero where out of range."""
    exponent = exponent_bits(exp_bits + 2, man_bits, x)
    exponent -= (1 << (exp_bits + 1)) - (1 << (exp_bits - 1))
    sign = x >> (exp_bits + 2 + man_bits)
    if exponent <= 0:
        return pack_bits(exp_bits, man_bits, sign, 0)
    if exponent >= (1 << exp_bits) - 1:
        return infinity_bits(exp_bits, man_bits, sign)
    mantissa = x & ((1 << man_bits) - 1)
    return pack_bits(exp_bits, man_bits, sign, (exponent << man_bits) | mantissa)


@njit(cache=True)
def intersect_bits(exp_bits, man_bits, row, vertices, sheared, overflows):
    """(hit, t, u, v) of a ray and a triangle; patterns, u and v the weights of vertices 1 and 2.

    After Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013), with the exact
    sign of each edge function: vertices relative to the origin are sheared so that the ray runs
    along z; the ray hits if the three edge functions, exact for the sheared vertices, have no two
    opposite signs and are not all zero. A vertex is sheared to the same bits in every triangle,
    so triangles that share an edge agree about it.

    `row` is of sim.model.rays.setup, `vertices` (3, 3) patterns, `sheared` (3, 3) room to work.
    Everything rounds to nearest; from the edge functions on with two exponent bits more. Sets its
    flag of `overflows`: by what comes before the edge functions, and by the numbers of a hit.
    """
    sign = 1 << (exp_bits + man_bits)
    z = row[AXIS_Z]
    x, y = (z + 1) % 3, (z + 2) % 3
    relative = np.empty(3, np.int64)
    infinite = False
    for k in range(3):
        for of, axis in enumerate((x, y, z)):
            vertex, origin = vertices[k, axis], row[ORIGIN + axis]
            relative[of] = add_bits(exp_bits, man_bits, NEAREST, vertex, origin ^ sign)
            infinite |= overflow_bits(exp_bits, man_bits, relative[of], vertex, origin)
        depth = relative[2]
        for of, shear in enumerate((SHEAR_X, SHEAR_Y, SHEAR_Z)):
            moved = mul_bits(exp_bits, man_bits, NEAREST, row[shear], depth)
            infinite |= overflow_bits(exp_bits, man_bits, moved, row[shear], depth)
            if of == 2:
                sheared[k, of] = moved
                break
            sheared[k, of] = add_bits(exp_bits, man_bits, NEAREST, relative[of], moved ^ sign)
            infinite |= overflow_bits(exp_bits, man_bits, sheared[k, of], relative[of], moved)
    overflows[TRIANGLES] |= infinite

    wide = exp_bits + 2
    wide_sign = 1 << (wide + man_bits)
    edges = np.empty(3, np.int64)
    positive = negative = False
    for k in range(3):
        b, c = (k + 1) % 3, (k + 2) % 3
        edges[k] = cross_bits(
            exp_bits, man_bits, sheared[c, 0], sheared[b, 1], sheared[c, 1], sheared[b, 0]
        )
        if edges[k] & (wide_sign - 1):
            if edges[k] & wide_sign:
                negative = True
            else:
                positive = True
    if positive == negative:
        return False, 0 * sign, 0 * sign, 0 * sign

    area = add_bits(wide, man_bits, NEAREST, edges[0], edges[1])
    area = add_bits(wide, man_bits, NEAREST, area, edges[2])
    inverse = recip_bits(wide, man_bits, NEAREST, area)
    depth = mul_bits(
        wide, man_bits, NEAREST, edges[0], widen_bits(exp_bits, man_bits, sheared[0, 2])
    )
    for k in range(1, 3):
        part = mul_bits(
            wide, man_bits, NEAREST, edges[k], widen_bits(exp_bits, man_bits, sheared[k, 2])
        )
        depth = add_bits(wide, man_bits, NEAREST, depth, part)
    t = narrow_bits(exp_bits, man_bits, mul_bits(wide, man_bits, NEAREST, depth, inverse))
    u = narrow_bits(exp_bits, man_bits, mul_bits(wide, man_bits, NEAREST, edges[1], inverse))
    v = narrow_bits(exp_bits, man_bits, mul_bits(wide, man_bits, NEAREST, edges[2], inverse))
    for number in (t, u, v):
        if exponent_bits(exp_bits, man_bits, number) == (1 << exp_bits) - 1:
            overflows[TRIANGLES] = True
    if t == sign:  # -0 is where +0 is
        t = 0 * sign
    return True, t, u, v
