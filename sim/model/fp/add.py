"""Model of hdl.fp.add: the sum of two floats."""

import numpy as np
from numba import njit

from hdl.fp.format import FloatFormat, Rounding
from sim.model.fp.round import (
    DOWN,
    any_value_bits,
    elementwise,
    exponent_bits,
    infinity_bits,
    pack_bits,
    round_bits,
    shift_jam_bits,
    significand_bits,
)

GUARD = 3  # bits below a significand: the two that rounding looks at after a shift by one, a jam


@njit(cache=True)
def add_to_bits(exp_bits, man_bits, to_man_bits, rounding, a, b):
    """Pattern, of to_man_bits mantissa bits, of a + b: as hdl.fp.add says."""
    top = (1 << exp_bits) - 1
    sign_a, sign_b = a >> (exp_bits + man_bits), b >> (exp_bits + man_bits)
    exponent_a = exponent_bits(exp_bits, man_bits, a)
    exponent_b = exponent_bits(exp_bits, man_bits, b)

    if exponent_a == top or exponent_b == top:
        if exponent_a == exponent_b and sign_a != sign_b:
            return any_value_bits(exp_bits, to_man_bits, rounding, 0)
        return infinity_bits(exp_bits, to_man_bits, sign_a if exponent_a == top else sign_b)

    zero_sign = sign_a | sign_b if rounding == DOWN else sign_a & sign_b
    large = significand_bits(exp_bits, man_bits, a) << GUARD if exponent_a else 0
    small = significand_bits(exp_bits, man_bits, b) << GUARD if exponent_b else 0
    sign, exponent, distance = sign_a, exponent_a, exponent_a - exponent_b
    if distance < 0 or (distance == 0 and small > large):
        large, small = small, large
        sign, exponent, distance = sign_b, exponent_b, -distance
    small = shift_jam_bits(small, distance)
    total = large - small if sign_a != sign_b else large + small
    if total == 0:
        return pack_bits(exp_bits, to_man_bits, zero_sign, 0)
    return round_bits(exp_bits, to_man_bits, rounding, sign, exponent - man_bits - GUARD, total)


@njit(cache=True)
def add_bits(exp_bits, man_bits, rounding, a, b):
    """Pattern of a + b."""
    return add_to_bits(exp_bits, man_bits, man_bits, rounding, a, b)


_add = elementwise(add_bits)


def add(fmt: FloatFormat, a, b, rounding: Rounding = Rounding.NEAREST) -> np.ndarray:
    """Patterns of a + b, rounded once."""
    return _add(fmt, rounding, a, b)
