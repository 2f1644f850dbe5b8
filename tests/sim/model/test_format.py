"""sim.model.fp.format against exact rationals, MPFR and numpy's own narrow floats."""

import math
from fractions import Fraction

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from sim.model.fp.format import decode, encode
from tests import oracle

FORMATS = [FloatFormat(*bits) for bits in [(2, 1), (3, 2), (4, 9), (5, 10), (7, 16), (8, 23)]]
NARROW = FORMATS[:4]
CASES = 1_000_000


def of_every(formats):
    return pytest.mark.parametrize("fmt", formats, ids=str)


def assert_encodes(fmt, x, expected):
    x, expected, found = np.atleast_1d(x), np.asarray(expected), encode(fmt, np.atleast_1d(x))
    assert found.dtype == np.int64
    wrong = np.flatnonzero(found != expected)
    if len(wrong):
        k = wrong[0]
        raise AssertionError(
            f"{len(wrong)} of {len(x)}; first {x[k].hex()}: {found[k]:#x}, not {expected[k]:#x}; "
            f"exact {oracle.decode(fmt, int(found[k]))}, not {oracle.decode(fmt, int(expected[k]))}"
        )


def assert_is_nearest(fmt, x):
    assert_encodes(fmt, x, [oracle.encode(fmt, value) for value in x.tolist()])


def smallest(fmt) -> float:
    """The smallest normal."""
    return float(oracle.decode(fmt, oracle.pattern(fmt, 0, 1, 0)))


def beyond(fmt) -> float:
    """The power of two after the largest number."""
    return 2 * float(oracle.decode(fmt, oracle.pattern(fmt, 0, 2**fmt.exp_bits - 2, 0)))


def with_neighbours(x):
    """Numbers, the float64 before and after each, and the negatives of all."""
    x = np.asarray(x, np.float64)
    x = np.concatenate([x, np.nextafter(x, np.inf), np.nextafter(x, -np.inf)])
    return np.concatenate([x, -x])


def corner_weighted(rng, fmt, count):
    """A third near the ends of the format, a third near ties, a third anywhere in float64."""
    third = count // 3
    ends = np.array([smallest(fmt), beyond(fmt), 1.0])
    near_ends = rng.choice(ends, third) * rng.uniform(0.25, 4, third)

    # An integer significand and a half, give or take what decides which way it goes.
    significand = rng.integers(1 << fmt.man_bits, 2 << fmt.man_bits, third)
    ties = significand + rng.choice([0, 0.5], third)
    ties += rng.choice([0, 0, 2.0**-20, -(2.0**-20), 2.0**-28, -(2.0**-28)], third)
    exponents = rng.integers(-fmt.bias - 4, fmt.bias + 4, third) - fmt.man_bits
    near_ties = np.ldexp(ties, exponents)

    raw = rng.integers(0, 0x7FF0_0000_0000_0001, count - 2 * third)  # up to infinity itself
    x = np.concatenate([near_ends, near_ties, raw.view(np.float64)])
    return x * rng.choice([-1.0, 1.0], count)


@of_every(NARROW)
def test_every_pattern_decodes_to_its_value(fmt):
    patterns = np.arange(1 << fmt.bits)
    values = decode(fmt, patterns)
    assert values.dtype == np.float64
    for bits, value in zip(patterns.tolist(), values.tolist(), strict=True):
        assert value == oracle.decode(fmt, bits), f"{bits:#x}"
        assert math.copysign(1, value) == (-1 if bits >> (fmt.bits - 1) else 1), f"{bits:#x}"


@of_every(NARROW)
def test_every_pattern_encodes_to_itself_or_to_its_canonical_form(fmt):
    patterns = np.arange(1 << fmt.bits)
    sign, exponent, mantissa = oracle.fields(fmt, patterns)
    special = (exponent == 0) | (exponent == 2**fmt.exp_bits - 1)
    canonical = oracle.pattern(fmt, sign, exponent, np.where(special, 0, mantissa))
    assert_encodes(fmt, decode(fmt, patterns), canonical)


@of_every(FORMATS[4:])
def test_wide_patterns_survive_decode_and_encode(fmt, rng):
    exponent = rng.integers(1, 2**fmt.exp_bits - 1, 20_000)
    exponent[:4] = 1, 1, 2**fmt.exp_bits - 2, 2**fmt.exp_bits - 2
    mantissa = rng.integers(0, 2**fmt.man_bits, 20_000)
    mantissa[:4] = 0, 2**fmt.man_bits - 1, 0, 2**fmt.man_bits - 1
    patterns = oracle.pattern(fmt, rng.integers(0, 2, 20_000), exponent, mantissa)
    values = decode(fmt, patterns)
    assert values.tolist() == [oracle.decode(fmt, bits) for bits in patterns.tolist()]
    assert_encodes(fmt, values, patterns)


@of_every(NARROW)
def test_ties_between_all_neighbours(fmt):
    positive = decode(fmt, np.arange(1 << fmt.man_bits, (2**fmt.exp_bits - 1) << fmt.man_bits))
    ends = np.append(positive, beyond(fmt))
    assert_is_nearest(fmt, with_neighbours((ends[1:] + ends[:-1]) / 2))


@of_every(FORMATS)
def test_around_the_smallest_normal_and_overflow(fmt):
    """Steps of an eighth of the spacing on both sides of both ends: ties, and what is not one."""
    steps = np.arange(-40, 41) * 2.0 ** (-fmt.man_bits - 4)
    for end in (smallest(fmt), beyond(fmt)):
        assert_is_nearest(fmt, with_neighbours(end * (1 + steps)))
        assert_is_nearest(fmt, with_neighbours(end * np.array([0.5, 0.25, 0.75, 1.5, 2, 4])))


@of_every(FORMATS)
def test_flush_and_overflow_come_after_rounding(fmt):
    """By hand: exponents have no end while a number is rounded."""
    half_ulp = 2.0 ** -(fmt.man_bits + 2)  # of the numbers just below a power of two
    zero, infinity = 0, oracle.pattern(fmt, 0, 2**fmt.exp_bits - 1, 0)
    tie = smallest(fmt) * (1 - half_ulp)
    assert encode(fmt, tie) == oracle.pattern(fmt, 0, 1, 0)
    assert encode(fmt, np.nextafter(tie, 0)) == zero
    tie = beyond(fmt) * (1 - half_ulp)
    assert encode(fmt, tie) == infinity
    assert encode(fmt, np.nextafter(tie, 0)) == infinity - 1


@of_every(FORMATS)
def test_zeros_infinities_and_the_ends_of_float64(fmt):
    tiny, large = np.finfo(np.float64).tiny, np.finfo(np.float64).max
    assert_is_nearest(fmt, with_neighbours([0.0, 5e-324, tiny, tiny / 2, large / 2]))
    assert_is_nearest(fmt, np.array([large, -large, np.inf, -np.inf, 0.0, -0.0]))
    sign = 1 << (fmt.bits - 1)
    assert encode(fmt, [0.0, -0.0, 5e-324, -5e-324]).tolist() == [0, sign, 0, sign]


@of_every(FORMATS)
def test_corner_weighted_against_rationals(fmt, rng):
    assert_is_nearest(fmt, corner_weighted(rng, fmt, 10_000))


@pytest.mark.parametrize(
    ("fmt", "count"), [(F24, CASES)] + [(f, CASES // 10) for f in FORMATS if f != F24], ids=str
)
def test_corner_weighted_against_mpfr(fmt, count, rng):
    x = corner_weighted(rng, fmt, count)
    assert_encodes(fmt, x, oracle.encode_mpfr(fmt, x))


def test_the_two_oracles_agree(rng):
    for fmt in FORMATS:
        x = corner_weighted(rng, fmt, 3_000)
        assert oracle.encode_mpfr(fmt, x).tolist() == [oracle.encode(fmt, v) for v in x.tolist()]


@pytest.mark.parametrize(
    ("fmt", "narrow", "raw"),
    [(FloatFormat(5, 10), np.float16, np.uint16), (FloatFormat(8, 23), np.float32, np.uint32)],
    ids=["float16", "float32"],
)
def test_agrees_with_ieee_where_that_has_no_subnormals(fmt, narrow, raw, rng):
    steps = np.arange(-40, 41) * 2.0 ** (-fmt.man_bits - 4)
    edge = with_neighbours(smallest(fmt) * (1 + steps))
    x = np.concatenate([edge, corner_weighted(rng, fmt, 300_000)])
    with np.errstate(over="ignore", under="ignore"):
        cast = x.astype(narrow)
    ieee = cast.view(raw).astype(np.int64)
    sign = ieee & 1 << (fmt.bits - 1)
    # Below the smallest normal numpy rounds to the grid of subnormals, so some numbers become the
    # smallest normal there that are nearer to the number before it where exponents have no end.
    reaches = np.abs(x) >= smallest(fmt) * (1 - 2.0 ** -(fmt.man_bits + 2))
    normal = np.abs(cast) >= smallest(fmt)
    assert (reaches <= normal).all() and 0 < (normal & ~reaches).sum() < 0.05 * len(x)
    assert_encodes(fmt, x, np.where(reaches, ieee, sign))


def test_shapes_and_other_types_of_input():
    assert encode(F24, 1.0).shape == ()
    assert encode(F24, np.zeros((4, 0, 3))).shape == (4, 0, 3)
    assert encode(F24, np.ones((2, 5, 3), np.float32)).tolist() == [[[63 << 16] * 3] * 5] * 2
    assert encode(F24, [1, -2]).tolist() == [63 << 16, 1 << 23 | 64 << 16]
    assert decode(F24, np.uint32(63 << 16)) == 1.0
    assert decode(F24, np.array([[63 << 16]], np.uint32)).tolist() == [[1.0]]


@pytest.mark.parametrize("x", [np.nan, -np.nan, [0.0, np.nan], [[np.inf], [np.nan]]])
def test_nan_is_refused(x):
    with pytest.raises(ValueError, match="NaN has no bit pattern"):
        encode(F24, x)


def test_oracle_by_hand():
    """The oracle itself, on what can be seen with the eye: 3 exponent and 2 mantissa bits."""
    fmt = FloatFormat(3, 2)
    for x, expected in {
        Fraction(1): 0b0_011_00,
        Fraction(7, 4): 0b0_011_11,
        Fraction(15, 8): 0b0_100_00,  # tie, to even
        Fraction(-13, 8): 0b1_011_10,  # tie, to even
        Fraction(1, 4): 0b0_001_00,  # smallest
        Fraction(14, 64): 0,
        Fraction(15, 64): 0b0_001_00,  # tie, rounds up to the smallest
        Fraction(14): 0b0_110_11,  # largest
        Fraction(15): 0b0_111_00,
        Fraction(-1, 10**400): 0b1_000_00,
        -0.0: 0b1_000_00,
        -math.inf: 0b1_111_00,
    }.items():
        assert oracle.encode(fmt, x) == expected, x
