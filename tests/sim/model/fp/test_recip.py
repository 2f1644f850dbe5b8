"""sim.model.fp.recip against exact rationals, float64 and MPFR."""

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat, Rounding
from sim.model.fp.recip import recip
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
from tests.sim.model.fp.operands import every, weighted


def one_over(x):
    return 1 / x


@every_rounding
@pytest.mark.parametrize("fmt", [FloatFormat(2, 1), TINY, FloatFormat(4, 6)], ids=str)
def test_every_operand_of_a_small_format(fmt, rounding):
    (a,) = every(fmt, 1)
    expected = [oracle.recip(fmt, rounding, bits) for bits in a.tolist()]
    assert_same(fmt, recip(fmt, a, rounding), expected, a)


@every_rounding
def test_every_mantissa_of_f24(rounding):
    exponents = np.array([0, 1, 2, 62, 63, 64, 124, 125, 126, 127])
    a = np.add.outer(exponents << F24.man_bits, np.arange(1 << F24.man_bits)).ravel()
    for sign in (0, 1 << (F24.bits - 1)):
        expected = oracle.recip_array(F24, rounding, a | sign)
        assert_same(F24, recip(F24, a | sign, rounding), expected, a | sign)


@pytest.mark.slow
@every_rounding
def test_every_operand_of_f24(rounding):
    for exponent in range(1 << (F24.exp_bits + 1)):
        a = np.arange(1 << F24.man_bits) | exponent << F24.man_bits
        assert_same(F24, recip(F24, a, rounding), oracle.recip_array(F24, rounding, a), a)


@every_rounding
@every_format
def test_weighted(fmt, rounding, rng):
    (a,) = weighted(fmt, rng, 1, 3 * cases(fmt))
    assert_same(fmt, recip(fmt, a, rounding), oracle.recip_array(fmt, rounding, a), a)


@every_rounding
def test_mpfr(rounding, rng):
    (a,) = weighted(F24, rng, 1, 10_000)
    assert_is_mpfr(F24, rounding, recip(F24, a, rounding), one_over, a)


def test_down_and_up_enclose(rng):
    (a,) = weighted(F24, rng, 1, cases(F24))
    assert_brackets(F24, *(recip(F24, a, r) for r in Rounding))
