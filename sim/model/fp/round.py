"""Model of hdl.fp.round: the one place that rounds, and the parts of a bit pattern.

Functions that end in `_bits` are of int64 scalars, for callers that numba compiles: `exp_bits` and
`man_bits` are those of the format, `rounding` a number of hdl.fp.format.Rounding. `elementwise`
makes the function of arrays from one.
"""

import numpy as np
from numba import njit, vectorize

from hdl.fp.format import FloatFormat, Rounding

NEAREST, DOWN, UP = map(int, Rounding)


@njit(cache=True)
def exponent_bits(exp_bits, man_bits, x):
    """Biased exponent of a pattern."""
    return (x >> man_bits) & ((1 << exp_bits) - 1)


@njit(cache=True)
def significand_bits(exp_bits, man_bits, x):
    """Mantissa of a pattern that is neither zero nor infinite, with the hidden one."""
    return (x & ((1 << man_bits) - 1)) | (1 << man_bits)


@njit(cache=True)
def pack_bits(exp_bits, man_bits, sign, magnitude):
    """Pattern of a sign and of exponent and mantissa as one number."""
    return (sign << (exp_bits + man_bits)) | magnitude


@njit(cache=True)
def infinity_bits(exp_bits, man_bits, sign):
    """Pattern of an infinity."""
    return pack_bits(exp_bits, man_bits, sign, ((1 << exp_bits) - 1) << man_bits)


@njit(cache=True)
def overflow_bits(exp_bits, man_bits, result, a, b):
    """A result is infinite, and its operands are not."""
    infinity = ((1 << exp_bits) - 1) << man_bits
    if result & infinity != infinity:
        return False
    return a & infinity != infinity and b & infinity != infinity


@njit(cache=True)
def any_value_bits(exp_bits, man_bits, rounding, sign):
    """Pattern of a result that could be any value: outwards, or zero of the sign to nearest."""
    if rounding == NEAREST:
        return pack_bits(exp_bits, man_bits, sign, 0)
    return infinity_bits(exp_bits, man_bits, 1 if rounding == DOWN else 0)


@njit(cache=True)
def shift_jam_bits(x, count):
    """`x` shifted right; if a one falls off, the lowest bit of what is left is one."""
    count = min(count, 62)
    return (x >> count) | (1 if x & ((1 << count) - 1) else 0)


@njit(cache=True)
def bit_length_bits(x):
    """Number of bits of a number from 1 to 2**62."""
    length = 1
    for step in (32, 16, 8, 4, 2, 1):
        if x >> step:
            x >>= step
            length += step
    return length


@njit(cache=True)
def round_bits(exp_bits, man_bits, rounding, sign, exponent, significand):
    """Pattern nearest to (-1)**sign * significand * 2**exponent, or beside it.

    `exponent` is biased, as if the mantissa were an integer: of a pattern of the format it is
    that of the pattern minus man_bits.

    Parameters
    ----------
    significand : int
        1 to 2**61. The lowest bit may be jammed where there are man_bits + 3 bits or more.
    """
    # Exactly man_bits + 3 bits: the significand, a half, and whether there is more.
    excess = bit_length_bits(significand) - (man_bits + 3)
    if excess > 0:
        significand = shift_jam_bits(significand, excess)
    else:
        significand <<= -excess
    exponent += excess + 2 + man_bits

    if rounding == NEAREST:
        up = significand & 2 and significand & 5
    else:
        up = significand & 3 and (rounding == UP) != sign
    # The hidden one counts up the exponent, and so does the carry of a mantissa of all ones.
    magnitude = ((exponent - 1) << man_bits) + (significand >> 2) + (1 if up else 0)

    smallest, infinity = 1 << man_bits, ((1 << exp_bits) - 1) << man_bits
    outward = rounding == NEAREST or (rounding == UP) != sign
    if magnitude < smallest:
        magnitude = smallest if outward and rounding != NEAREST else 0
    elif magnitude >= infinity:
        magnitude = infinity if outward else infinity - 1
    return pack_bits(exp_bits, man_bits, sign, magnitude)


def elementwise(function):
    """The function of `fmt`, patterns and further integers, of one of scalars."""
    compiled = vectorize(cache=True)(function.py_func)

    def call(fmt: FloatFormat, *operands) -> np.ndarray:
        return compiled(fmt.exp_bits, fmt.man_bits, *(np.asarray(x, np.int64) for x in operands))

    return call
