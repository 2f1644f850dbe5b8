"""Comparison of what a model gives with what it should, in arrays of patterns."""

import gmpy2
import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat, Rounding
from tests import oracle
from tests.payloads import float_difference

TINY = FloatFormat(3, 3)
FORMATS = [FloatFormat(2, 1), FloatFormat(2, 3), FloatFormat(4, 9), F24, FloatFormat(8, 23)]

every_rounding = pytest.mark.parametrize("rounding", Rounding, ids=lambda r: r.name.lower())
every_format = pytest.mark.parametrize("fmt", FORMATS, ids=str)


def cases(fmt) -> int:
    """Of a class and a rounding: with three of each, a million of F24."""
    return 120_000 if fmt == F24 else 20_000


DIRECTIONS = {
    Rounding.NEAREST: gmpy2.RoundToNearest,
    Rounding.DOWN: gmpy2.RoundDown,
    Rounding.UP: gmpy2.RoundUp,
}


def assert_same(fmt, found, expected, *operands):
    """Patterns are equal; the first that is not is shown with its operands."""
    found, expected = np.asarray(found), np.asarray(expected)
    assert found.dtype == np.int64 and found.shape == expected.shape
    wrong = np.flatnonzero(found != expected)
    if len(wrong):
        k = wrong[0]
        of = " ".join(f"{int(column[k]):x}" for column in operands)
        raise AssertionError(
            f"{len(wrong)} of {len(found)}; first of {of}: "
            f"{float_difference(fmt, int(found[k]), int(expected[k]))}"
        )


def assert_brackets(fmt, nearest, down, up):
    """Numbers of each rounding: DOWN <= NEAREST <= UP."""
    for low, high in [(down, nearest), (nearest, up)]:
        low, high = (_rank(fmt, x) for x in (low, high))
        assert (low <= high).all()


def _rank(fmt, x):
    """Order of numbers; zeros are equal."""
    magnitude = x & ((1 << fmt.bits - 1) - 1)
    return np.where(x >> (fmt.bits - 1), -magnitude, magnitude)


def assert_is_mpfr(fmt, rounding, found, operation, *operands):
    """Patterns are what MPFR rounds to, where that is within the format."""
    checked = 0
    with gmpy2.context(precision=fmt.man_bits + 1, round=DIRECTIONS[rounding]):
        for bits, *row in zip(found.tolist(), *(x.tolist() for x in operands), strict=True):
            values = [float(oracle.decode(fmt, x)) for x in row]
            if not all(map(np.isfinite, values)) or 0 in values:
                continue
            exact = operation(*map(gmpy2.mpfr, values))
            got = float(oracle.decode(fmt, bits))
            biased = oracle.fields(fmt, bits)[1]
            if 1 < biased < 2**fmt.exp_bits - 2:
                assert got == exact, f"{bits:x} of {row}: {got!r}, not {exact!r}"
                checked += 1
    assert checked > len(found) / 10
