"""sim.model.fp.mul against exact rationals, float64 and MPFR."""

import operator

from hdl.fp.format import F24, Rounding
from sim.model.fp.mul import mul
from tests.sim.model.fp import oracle
from tests.sim.model.fp.check import (
    TINY,
    assert_brackets,
    assert_is_mpfr,
    assert_same,
    cases,
    every_format,
    every_rounding,
)
from tests.sim.model.fp.operands import classes, every, near_mul


@every_rounding
def test_every_pair_of_a_tiny_format(rounding):
    a, b = every(TINY, 2)
    expected = [
        oracle.mul(TINY, rounding, *row) for row in zip(a.tolist(), b.tolist(), strict=True)
    ]
    assert_same(TINY, mul(TINY, a, b, rounding), expected, a, b)


@every_rounding
@every_format
def test_three_classes(fmt, rounding, rng):
    for a, b in classes(fmt, rng, cases(fmt), 2, near_mul).values():
        expected = oracle.mul_array(fmt, rounding, a, b)
        assert_same(fmt, mul(fmt, a, b, rounding), expected, a, b)


@every_rounding
def test_mpfr(rounding, rng):
    a, b = near_mul(F24, rng, 10_000)
    assert_is_mpfr(F24, rounding, mul(F24, a, b, rounding), operator.mul, a, b)


def test_down_and_up_enclose(rng):
    a, b = near_mul(F24, rng, cases(F24))
    assert_brackets(F24, *(mul(F24, a, b, r) for r in Rounding))
