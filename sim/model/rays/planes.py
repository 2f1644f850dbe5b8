"""Model of hdl.rays.planes: the part of a ray between the two planes of a child."""

from numba import njit

from sim.model.fp.add import add_bits
from sim.model.fp.mul import mul_bits
from sim.model.fp.round import DOWN, UP, overflow_bits
from sim.model.rays.overflow import PLANES
from sim.model.rays.setup import ABOVE, BELOW, INVERSE_DOWN, INVERSE_UP, NEGATIVE


@njit(cache=True)
def key_bits(exp_bits, man_bits, x):
    """Integer in the order of floats: as sim.model.fp.order.order_key."""
    sign = 1 << (exp_bits + man_bits)
    return sign - 1 - x if x & sign else x


@njit(cache=True)
def clip_bits(exp_bits, man_bits, row, axis, low, high, near, far, overflows):
    """Keys (near, far) of a ray's interval, clipped to the slab [low, high] on an axis.

    `row` is of sim.model.rays.setup; near and far are order keys, low and high patterns. Every
    rounding goes outward: near is never above and far never below the exact value, for a ray
    from anywhere within the margin around its origin.

    low - above down, high - below up; of these the one that the ray meets first, times the
    inverse that makes the product least, down; the other, times that which makes it greatest, up.
    Sets its flag of `overflows`.
    """
    sign = 1 << (exp_bits + man_bits)
    first = add_bits(exp_bits, man_bits, DOWN, low, row[ABOVE + axis] ^ sign)
    last = add_bits(exp_bits, man_bits, UP, high, row[BELOW + axis] ^ sign)
    infinite = overflow_bits(exp_bits, man_bits, first, low, row[ABOVE + axis])
    infinite |= overflow_bits(exp_bits, man_bits, last, high, row[BELOW + axis])
    if row[NEGATIVE + axis]:
        first, last = last, first
    down, up = row[INVERSE_DOWN + axis], row[INVERSE_UP + axis]
    down, up = up if first & sign else down, down if last & sign else up
    begin = mul_bits(exp_bits, man_bits, DOWN, first, down)
    end = mul_bits(exp_bits, man_bits, UP, last, up)
    infinite |= overflow_bits(exp_bits, man_bits, begin, first, down)
    infinite |= overflow_bits(exp_bits, man_bits, end, last, up)
    overflows[PLANES] |= infinite
    return (
        max(near, key_bits(exp_bits, man_bits, begin)),
        min(far, key_bits(exp_bits, man_bits, end)),
    )
