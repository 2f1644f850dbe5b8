"""sim.model.fp.cross against exact rationals and float64."""

from fractions import Fraction

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from sim.model.fp.cross import cross
from tests import oracle as numbers
from tests.sim.model.fp import oracle
from tests.sim.model.fp.check import assert_same, cases, every_format
from tests.sim.model.fp.operands import classes, every, near_cross


def test_every_quadruple_of_the_smallest_format():
    fmt, rows = FloatFormat(2, 1), every(FloatFormat(2, 1), 4)
    expected = [oracle.cross(fmt, fmt.difference, *row) for row in rows.T.tolist()]
    assert_same(fmt.difference, cross(fmt, *rows), expected, *rows)


def test_every_quadruple_of_a_tiny_format():
    fmt, rows = FloatFormat(3, 1), every(FloatFormat(3, 1), 4)
    expected = oracle.cross_array(fmt, fmt.difference, *rows)
    assert_same(fmt.difference, cross(fmt, *rows), expected, *rows)


@every_format
def test_three_classes(fmt, rng):
    for rows in classes(fmt, rng, 3 * cases(fmt), 4, near_cross).values():
        expected = oracle.cross_array(fmt, fmt.difference, *rows)
        assert_same(fmt.difference, cross(fmt, *rows), expected, *rows)


def test_exact_rationals(rng):
    rows = near_cross(F24, rng, 5_000)
    expected = [oracle.cross(F24, F24.difference, *row) for row in rows.T.tolist()]
    assert_same(F24.difference, cross(F24, *rows), expected, *rows)


@pytest.mark.parametrize("fmt", [F24, FloatFormat(8, 23)], ids=str)
def test_zero_if_the_products_are_equal_and_only_then(fmt, rng):
    rows = near_cross(fmt, rng, 5_000)
    finite = (rows >> fmt.man_bits & (1 << fmt.exp_bits) - 1 != (1 << fmt.exp_bits) - 1).all(axis=0)
    rows = rows[:, finite]
    found = cross(fmt, *rows)
    magnitude, sign = found & (1 << fmt.difference.bits - 1) - 1, found >> fmt.difference.bits - 1
    assert (magnitude >> fmt.man_bits < (1 << fmt.difference.exp_bits) - 1).all()
    signs = np.where(magnitude == 0, 0, 1 - 2 * sign)
    for k, row in enumerate(rows.T.tolist()):
        a, b, c, d = (Fraction(numbers.decode(fmt, bits)) for bits in row)
        exact = a * b - c * d
        assert signs[k] == (exact > 0) - (exact < 0), row
    assert 0.05 < (signs == 0).mean() < 0.5


@pytest.mark.parametrize("bits", [(2, 4), (9, 16)])
def test_formats_whose_differences_have_none(bits):
    with pytest.raises(ValueError):
        _ = FloatFormat(*bits).difference
