"""Model of hdl.fp.recip: the reciprocal of a float."""

import numpy as np
from numba import njit

from hdl.fp.format import FloatFormat, Rounding
from sim.model.fp.round import (
    elementwise,
    exponent_bits,
    infinity_bits,
    pack_bits,
    round_bits,
    significand_bits,
)


@njit(cache=True)
def recip_bits(exp_bits, man_bits, rounding, a):
    """Pattern of 1 / a."""
    top, bias = (1 << exp_bits) - 1, (1 << (exp_bits - 1)) - 1
    sign = a >> (exp_bits + man_bits)
    exponent = exponent_bits(exp_bits, man_bits, a)
    if exponent == 0:
        return infinity_bits(exp_bits, man_bits, sign)
    if exponent == top:
        return pack_bits(exp_bits, man_bits, sign, 0)
    significand = significand_bits(exp_bits, man_bits, a)
    one = 1 << (2 * man_bits + 3)  # the quotient has man_bits + 3 bits or more
    quotient = one // significand
    quotient |= 1 if quotient * significand != one else 0
    return round_bits(
        exp_bits, man_bits, rounding, sign, 2 * bias - exponent - man_bits - 3, quotient
    )


_recip = elementwise(recip_bits)


def recip(fmt: FloatFormat, a, rounding: Rounding = Rounding.NEAREST) -> np.ndarray:
    """Patterns of 1 / a, rounded once."""
    return _recip(fmt, rounding, a)
