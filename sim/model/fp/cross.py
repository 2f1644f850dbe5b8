"""Model of hdl.fp.cross: the difference of two products, with the exact sign."""

import numpy as np
from numba import njit

from hdl.fp.format import FloatFormat
from sim.model.fp.add import add_to_bits
from sim.model.fp.round import (
    NEAREST,
    elementwise,
    exponent_bits,
    infinity_bits,
    pack_bits,
    significand_bits,
)


@njit(cache=True)
def product_bits(exp_bits, man_bits, negate, a, b):
    """Pattern, in the format of products, of a * b or -(a * b): exact. Every zero is +0."""
    top = (1 << exp_bits) - 1
    sign = ((a ^ b) >> (exp_bits + man_bits)) ^ negate
    exponent_a = exponent_bits(exp_bits, man_bits, a)
    exponent_b = exponent_bits(exp_bits, man_bits, b)
    to_exp_bits, to_man_bits = exp_bits + 2, 2 * man_bits + 1
    if exponent_a == 0 or exponent_b == 0:
        return 0 * a
    if exponent_a == top or exponent_b == top:
        return infinity_bits(to_exp_bits, to_man_bits, sign)
    product = significand_bits(exp_bits, man_bits, a) * significand_bits(exp_bits, man_bits, b)
    # The bias of the result minus those of a and b: 2**(n + 1) - 1 - 2 * (2**(n - 1) - 1).
    exponent = exponent_a + exponent_b + (1 << exp_bits) + 1
    if product >> to_man_bits:
        exponent += 1
    else:
        product <<= 1
    mantissa = product & ((1 << to_man_bits) - 1)
    return pack_bits(to_exp_bits, to_man_bits, sign, (exponent << to_man_bits) | mantissa)


@njit(cache=True)
def cross_bits(exp_bits, man_bits, a, b, c, d):
    """Pattern, in the format of differences, of a * b - c * d."""
    return add_to_bits(
        exp_bits + 2,
        2 * man_bits + 1,
        man_bits,
        NEAREST,
        product_bits(exp_bits, man_bits, 0, a, b),
        product_bits(exp_bits, man_bits, 1, c, d),
    )


_cross = elementwise(cross_bits)


def cross(fmt: FloatFormat, a, b, c, d) -> np.ndarray:
    """Patterns, in `fmt.difference`, of a * b - c * d, rounded to nearest once."""
    return _cross(fmt, a, b, c, d)
