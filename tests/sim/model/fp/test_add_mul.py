"""sim.model.fp.add and mul against exact rationals, float64 and MPFR."""

import operator
from collections.abc import Callable
from typing import NamedTuple

import numba
import numpy as np
import pytest

from hdl.fp.format import F24, Rounding
from sim.model.fp.add import add, add_bits
from sim.model.fp.mul import mul, mul_bits
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
from tests.sim.model.fp.operands import classes, every, near_add, near_mul


class Operation(NamedTuple):
    """A model, how numba calls it, what tells its results, and operands near its corners."""

    model: Callable
    bits: Callable
    exact: Callable
    exact_array: Callable
    mpfr: Callable
    near: Callable


OPERATIONS = {
    "add": Operation(add, add_bits, oracle.add, oracle.add_array, operator.add, near_add),
    "mul": Operation(mul, mul_bits, oracle.mul, oracle.mul_array, operator.mul, near_mul),
}


@pytest.fixture(params=OPERATIONS)
def operation(request) -> Operation:
    return OPERATIONS[request.param]


@every_rounding
def test_every_pair_of_a_tiny_format(operation, rounding):
    a, b = every(TINY, 2)
    rows = zip(a.tolist(), b.tolist(), strict=True)
    expected = [operation.exact(TINY, rounding, *row) for row in rows]
    assert_same(TINY, operation.model(TINY, a, b, rounding), expected, a, b)


@every_rounding
@every_format
def test_three_classes(operation, fmt, rounding, rng):
    for a, b in classes(fmt, rng, cases(fmt), 2, operation.near).values():
        expected = operation.exact_array(fmt, rounding, a, b)
        assert_same(fmt, operation.model(fmt, a, b, rounding), expected, a, b)


@every_rounding
def test_mpfr(operation, rounding, rng):
    a, b = operation.near(F24, rng, 10_000)
    found = operation.model(F24, a, b, rounding)
    assert_is_mpfr(F24, rounding, found, operation.mpfr, a, b)


def test_down_and_up_enclose(operation, rng):
    a, b = operation.near(F24, rng, cases(F24))
    assert_brackets(F24, *(operation.model(F24, a, b, r) for r in Rounding))


def test_scalars_from_numba(operation, rng):
    bits = operation.bits

    @numba.njit
    def loop(exp_bits, man_bits, rounding, a, b):
        out = np.empty_like(a)
        for k in range(len(a)):
            out[k] = bits(exp_bits, man_bits, rounding, a[k], b[k])
        return out

    a, b = operation.near(F24, rng, 1000)
    found = loop(F24.exp_bits, F24.man_bits, int(Rounding.UP), a, b)
    assert_same(F24, found, operation.model(F24, a, b, Rounding.UP), a, b)
