"""What the operations of hdl.fp give, by their tables: shares no code with design and model.

Twice: in exact rationals, one at a time, and in float64 arrays, exact by another way.
"""

import functools
import math
from fractions import Fraction

import numpy as np

from hdl.fp.format import Rounding
from tests import oracle

NEAREST, DOWN, UP = Rounding


# Exact rationals

decode = functools.cache(oracle.decode)


def rounded(fmt, rounding, x: Fraction, negative_zero: bool) -> int:
    """Pattern of an exact number: as if exponents had no end, then what is out of range."""
    if x == 0:
        return oracle.pattern(fmt, int(negative_zero), 0, 0)
    exponent = abs(x).numerator.bit_length() - x.denominator.bit_length()
    if abs(x) < Fraction(2) ** exponent:
        exponent -= 1
    ulp = Fraction(2) ** (exponent - fmt.man_bits)
    x = {NEAREST: round, DOWN: math.floor, UP: math.ceil}[rounding](x / ulp) * ulp
    last = 2**fmt.exp_bits - 2
    smallest = decode(fmt, oracle.pattern(fmt, 0, 1, 0))
    largest = decode(fmt, oracle.pattern(fmt, 0, last, 2**fmt.man_bits - 1))
    outward = rounding == (UP if x > 0 else DOWN)
    if abs(x) < smallest:
        return oracle.pattern(fmt, int(x < 0), int(outward), 0)
    if abs(x) > largest:
        if outward or rounding == NEAREST:
            return oracle.pattern(fmt, int(x < 0), last + 1, 0)
        return oracle.pattern(fmt, int(x < 0), last, 2**fmt.man_bits - 1)
    return oracle.encode(fmt, x)


def infinity(fmt, negative) -> int:
    return oracle.pattern(fmt, int(negative), 2**fmt.exp_bits - 1, 0)


def any_value(fmt, rounding, negative_zero) -> int:
    if rounding == NEAREST:
        return oracle.pattern(fmt, int(negative_zero), 0, 0)
    return infinity(fmt, rounding == DOWN)


def negative(fmt, bits: int) -> bool:
    return bool(oracle.fields(fmt, bits)[0])


def add(fmt, rounding, a: int, b: int) -> int:
    x, y = decode(fmt, a), decode(fmt, b)
    if math.isinf(x) or math.isinf(y):
        if x == -y:
            return any_value(fmt, rounding, False)
        return infinity(fmt, (x if math.isinf(x) else y) < 0)
    signs = [negative(fmt, a), negative(fmt, b)]
    return rounded(fmt, rounding, x + y, any(signs) if rounding == DOWN else all(signs))


def mul(fmt, rounding, a: int, b: int) -> int:
    x, y = decode(fmt, a), decode(fmt, b)
    minus = negative(fmt, a) != negative(fmt, b)
    if math.isinf(x) or math.isinf(y):
        return any_value(fmt, rounding, minus) if 0 in (x, y) else infinity(fmt, minus)
    return rounded(fmt, rounding, x * y, minus)


def recip(fmt, rounding, a: int) -> int:
    x, minus = decode(fmt, a), negative(fmt, a)
    if x == 0:
        return infinity(fmt, minus)
    return rounded(fmt, rounding, Fraction(0) if math.isinf(x) else 1 / x, minus)


def cross(fmt, to, a: int, b: int, c: int, d: int) -> int:
    """Of format `fmt`, into format `to`."""
    (x, y), (z, w) = ([decode(fmt, v) for v in pair] for pair in ((a, b), (c, d)))
    left, right = (0 if 0 in pair else pair[0] * pair[1] for pair in ((x, y), (z, w)))
    if left == right:
        return 0
    if math.isinf(left) or math.isinf(right):
        return infinity(to, left < 0 if math.isinf(left) else right > 0)
    return rounded(to, NEAREST, left - right, False)


# float64 arrays


def decode_array(fmt, bits) -> np.ndarray:
    """Values of patterns, zeros with their sign."""
    sign, mantissa = bits >> (fmt.exp_bits + fmt.man_bits), bits & ((1 << fmt.man_bits) - 1)
    exponent = bits >> fmt.man_bits & ((1 << fmt.exp_bits) - 1)
    raw = exponent - 2 ** (fmt.exp_bits - 1) + 1 + 1023 << 52 | mantissa << (52 - fmt.man_bits)
    raw = np.where(exponent == 0, 0, raw)
    raw = np.where(exponent == 2**fmt.exp_bits - 1, 0x7FF << 52, raw)
    return np.where(sign == 1, -raw.view(np.float64), raw.view(np.float64))


def rounded_array(fmt, rounding, x, error) -> np.ndarray:
    """Patterns of x + error, of which x is the nearest float64; no NaN.

    An x whose last bit is odd lies on the right side of whatever fewer bits can hold, and of the
    middle between two of these; of an even one, the neighbour towards the error does.
    """
    inexact = (error != 0) & (x.view(np.int64) & 1 == 0)
    x = np.where(inexact, np.nextafter(x, np.copysign(np.inf, error)), x)
    fraction, exponent = np.frexp(np.where(np.isinf(x), 0, x))
    integer = {NEAREST: np.rint, DOWN: np.floor, UP: np.ceil}[rounding]
    y = np.ldexp(integer(np.ldexp(fraction, fmt.man_bits + 1)), exponent - fmt.man_bits - 1)
    bias = 2 ** (fmt.exp_bits - 1) - 1
    smallest, beyond = 2.0 ** (1 - bias), 2.0 ** (bias + 1)
    largest = beyond - 2.0 ** (bias - fmt.man_bits)
    outward = np.zeros(x.shape, bool) if rounding == NEAREST else (x > 0) == (rounding == UP)
    small, large = np.abs(y) < smallest, np.abs(y) >= beyond
    magnitude = np.where(small, np.where(outward & (y != 0), smallest, 0), np.abs(y))
    magnitude = np.where(large, largest, magnitude)
    magnitude = np.where(np.isinf(x) | large & (outward | (rounding == NEAREST)), np.inf, magnitude)
    raw = magnitude.view(np.int64)
    exponent = np.where(magnitude == 0, 0, (raw >> 52) - 1023 + bias)
    exponent = np.where(np.isinf(magnitude), 2 * bias + 1, exponent)
    mantissa = np.where(np.isinf(magnitude), 0, (raw & ((1 << 52) - 1)) >> (52 - fmt.man_bits))
    return oracle.pattern(fmt, np.signbit(x).astype(np.int64), exponent, mantissa)


def any_value_array(rounding, x, zero):
    """What stands for NaN."""
    return np.where(np.isnan(x), {NEAREST: zero, DOWN: -np.inf, UP: np.inf}[rounding], x)


def sum_array(x, y):
    """The float64 nearest to x + y, and the exact rest (Knuth)."""
    with np.errstate(invalid="ignore"):
        total = x + y
        back = total - x
        rest = (x - (total - back)) + (y - back)
    return total, np.where(np.isfinite(total), rest, 0)


def add_array(fmt, rounding, a, b):
    x, y = decode_array(fmt, a), decode_array(fmt, b)
    total, rest = sum_array(x, y)
    total = any_value_array(rounding, total, 0.0)
    if rounding == DOWN:
        total = np.where((total == 0) & (np.signbit(x) | np.signbit(y)), -0.0, total)
    return rounded_array(fmt, rounding, total, rest)


def mul_array(fmt, rounding, a, b):
    x, y = decode_array(fmt, a), decode_array(fmt, b)
    with np.errstate(invalid="ignore"):
        product = x * y  # exact: 53 bits hold two significands
    zero = np.copysign(0.0, np.copysign(1, x) * np.copysign(1, y))
    return rounded_array(fmt, rounding, any_value_array(rounding, product, zero), np.zeros(x.shape))


def cross_array(fmt, to, a, b, c, d):
    x, y, z, w = (decode_array(fmt, v) for v in (a, b, c, d))
    with np.errstate(invalid="ignore"):
        left, right = (np.where((p == 0) | (q == 0), 0.0, p * q) for p, q in ((x, y), (z, w)))
    total, rest = sum_array(left, -right)
    total = np.where(np.isnan(total) | (total == 0), 0.0, total)
    return rounded_array(to, NEAREST, total, rest)


def recip_array(fmt, rounding, a):
    # Unless it is exact, 1 / x of n bits differs by 2 ** -2n of it from what n + 1 bits can hold.
    x = decode_array(fmt, a)
    with np.errstate(divide="ignore"):
        return rounded_array(fmt, rounding, 1 / x, np.zeros(x.shape))
