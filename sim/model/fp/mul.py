"""Model of hdl.fp.mul: the product of two floats."""

import numpy as np
from numba import njit

from hdl.fp.format import FloatFormat, Rounding
from sim.model.fp.round import (
    any_value_bits,
    elementwise,
    exponent_bits,
    infinity_bits,
    pack_bits,
    round_bits,
    significand_bits,
)


@njit(cache=True)
def mul_bits(exp_bits, man_bits, rounding, a, b):
    """Pattern of a * b."""
    top, bias = (1 << exp_bits) - 1, (1 << (exp_bits - 1)) - 1
    sign = (a ^ b) >> (exp_bits + man_bits)
    exponent_a = exponent_bits(exp_bits, man_bits, a)
    exponent_b = exponent_bits(exp_bits, man_bits, b)
    zero, infinite = exponent_a == 0 or exponent_b == 0, exponent_a == top or exponent_b == top
    if zero and infinite:
        return any_value_bits(exp_bits, man_bits, rounding, sign)
    if infinite:
        return infinity_bits(exp_bits, man_bits, sign)
    if zero:
        return pack_bits(exp_bits, man_bits, sign, 0)
    product = significand_bits(exp_bits, man_bits, a) * significand_bits(exp_bits, man_bits, b)
    exponent = exponent_a + exponent_b - bias - 2 * man_bits
    return round_bits(exp_bits, man_bits, rounding, sign, exponent, product)


_mul = elementwise(mul_bits)


def mul(fmt: FloatFormat, a, b, rounding: Rounding = Rounding.NEAREST) -> np.ndarray:
    """Patterns of a * b, rounded once."""
    return _mul(fmt, rounding, a, b)
