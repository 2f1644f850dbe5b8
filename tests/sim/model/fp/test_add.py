"""sim.model.fp.add against exact rationals, float64 and MPFR."""

import operator

import numba
import numpy as np

from hdl.fp.format import F24, Rounding
from sim.model.fp.add import add, add_bits
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
from tests.sim.model.fp.operands import classes, every, near_add


@every_rounding
def test_every_pair_of_a_tiny_format(rounding):
    a, b = every(TINY, 2)
    expected = [
        oracle.add(TINY, rounding, *row) for row in zip(a.tolist(), b.tolist(), strict=True)
    ]
    assert_same(TINY, add(TINY, a, b, rounding), expected, a, b)


@every_rounding
@every_format
def test_three_classes(fmt, rounding, rng):
    for a, b in classes(fmt, rng, cases(fmt), 2, near_add).values():
        expected = oracle.add_array(fmt, rounding, a, b)
        assert_same(fmt, add(fmt, a, b, rounding), expected, a, b)


@every_rounding
def test_mpfr(rounding, rng):
    a, b = near_add(F24, rng, 10_000)
    assert_is_mpfr(F24, rounding, add(F24, a, b, rounding), operator.add, a, b)


def test_down_and_up_enclose(rng):
    a, b = near_add(F24, rng, cases(F24))
    assert_brackets(F24, *(add(F24, a, b, r) for r in Rounding))


def test_scalars_from_numba(rng):
    @numba.njit
    def loop(exp_bits, man_bits, rounding, a, b):
        out = np.empty_like(a)
        for k in range(len(a)):
            out[k] = add_bits(exp_bits, man_bits, rounding, a[k], b[k])
        return out

    a, b = near_add(F24, rng, 1000)
    assert_same(
        F24,
        loop(F24.exp_bits, F24.man_bits, int(Rounding.UP), a, b),
        add(F24, a, b, Rounding.UP),
        a,
        b,
    )
