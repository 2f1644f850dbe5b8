"""What numbers and their order are, from the definitions: shares no code with design and model.

A format `fmt` is anything with `exp_bits` and `man_bits`: only these two numbers of it are read.
Patterns are ints: mantissa in the lowest bits, exponent above, sign on top.
"""

import math
from fractions import Fraction

import gmpy2
import numpy as np


def encode(fmt, x: Fraction | float) -> int:
    """The pattern nearest to `x`, in exact rational arithmetic.

    To nearest even as if exponents had no end; then below the smallest normal becomes zero and
    above the largest number infinity. Signs stay.
    """
    sign = math.copysign(1, x) < 0 if isinstance(x, float) else x < 0
    if isinstance(x, float) and math.isinf(x):
        return pattern(fmt, sign, 2**fmt.exp_bits - 1, 0)
    magnitude = abs(Fraction(x))
    if magnitude == 0:
        return pattern(fmt, sign, 0, 0)
    exponent = magnitude.numerator.bit_length() - magnitude.denominator.bit_length()
    if magnitude < Fraction(2) ** exponent:
        exponent -= 1
    significand = round(magnitude / Fraction(2) ** exponent * 2**fmt.man_bits)  # halves to even
    if significand == 2 ** (fmt.man_bits + 1):
        exponent, significand = exponent + 1, significand // 2
    biased = exponent + 2 ** (fmt.exp_bits - 1) - 1
    if biased < 1:
        return pattern(fmt, sign, 0, 0)
    if biased > 2**fmt.exp_bits - 2:
        return pattern(fmt, sign, 2**fmt.exp_bits - 1, 0)
    return pattern(fmt, sign, biased, significand - 2**fmt.man_bits)


def encode_mpfr(fmt, x: np.ndarray) -> np.ndarray:
    """Patterns int64 nearest to float64 numbers (n,): rounded by MPFR, 1.5 M a second."""
    precision = fmt.man_bits + 1
    with gmpy2.context(emin=gmpy2.get_emin_min(), emax=gmpy2.get_emax_max()):
        rounded = np.array([float(gmpy2.mpfr(value, precision)) for value in x.tolist()])
    # Of a float64 that is a number of the format, sign, exponent and mantissa can be read off.
    raw = rounded.view(np.int64)
    bias = 2 ** (fmt.exp_bits - 1) - 1
    biased = (raw >> 52 & 0x7FF) - 1023 + bias
    mantissa = (raw & (1 << 52) - 1) >> 52 - fmt.man_bits
    zero, infinite = biased < 1, biased > 2**fmt.exp_bits - 2
    mantissa[zero | infinite] = 0
    biased[zero], biased[infinite] = 0, 2**fmt.exp_bits - 1
    return pattern(fmt, raw < 0, biased, mantissa)


def decode(fmt, bits: int) -> Fraction | float:
    """The exact value of a pattern; infinities are floats, zeros lose their sign."""
    sign, exponent, mantissa = fields(fmt, bits)
    if exponent == 2**fmt.exp_bits - 1:
        return -math.inf if sign else math.inf
    if exponent == 0:
        return Fraction(0)
    significand = 1 + Fraction(mantissa, 2**fmt.man_bits)
    magnitude = significand * Fraction(2) ** (exponent - 2 ** (fmt.exp_bits - 1) + 1)
    return -magnitude if sign else magnitude


def order(fmt, bits: int) -> tuple:
    """A key in the total order: by value, then -0 below +0, then away from zero.

    The last tells patterns apart that are not canonical: zeros and infinities with a mantissa.
    """
    sign, _, mantissa = fields(fmt, bits)
    return decode(fmt, bits), not sign, -mantissa if sign else mantissa


def low(fmt, *patterns: int) -> int:
    return min(patterns, key=lambda bits: order(fmt, bits))


def high(fmt, *patterns: int) -> int:
    return max(patterns, key=lambda bits: order(fmt, bits))


def fields(fmt, bits: int) -> tuple[int, int, int]:
    """Sign, biased exponent and mantissa."""
    mantissa = bits % 2**fmt.man_bits
    exponent = bits // 2**fmt.man_bits % 2**fmt.exp_bits
    return bits // 2 ** (fmt.man_bits + fmt.exp_bits), exponent, mantissa


def pattern(fmt, sign, exponent, mantissa):
    """The inverse of `fields`, of ints and of arrays."""
    return (sign * 2**fmt.exp_bits + exponent) * 2**fmt.man_bits + mantissa
