"""sim.oracle.exact against rationals."""

from fractions import Fraction

import numpy as np
import pytest

from sim.oracle.exact import ERROR, determinant, rounded, two_product, two_sum
from tests.sim.oracle import brute

ZERO = np.zeros(3)


def numbers(rng, *shape):
    """Of all magnitudes from 2^-40 to 2^40, and some zeros."""
    x = rng.standard_normal(shape) * 2.0 ** rng.integers(-40, 41, shape)
    return np.where(rng.random(shape) < 0.1, 0.0, x)


def sign(x) -> int:
    return (x > 0) - (x < 0)


@pytest.mark.parametrize("part", [two_sum, two_product])
def test_two_parts_are_exact(rng, part):
    for a, b in numbers(rng, 2000, 2).tolist():
        high, low = part(a, b)
        exactly = Fraction(a) + Fraction(b) if part is two_sum else Fraction(a) * Fraction(b)
        assert Fraction(high) + Fraction(low) == exactly
        assert high == float(exactly)


def expected(rows):
    return brute.determinant(*(brute.minus(brute.exact(p), brute.exact(q)) for p, q in rows))


def test_determinant_of_random_vectors(rng):
    for rows in numbers(rng, 1000, 3, 2, 3):
        exactly = expected(rows)
        got = determinant(*rows.reshape(6, 3))
        assert sign(got) == sign(exactly)
        assert abs(Fraction(got) - exactly) <= abs(exactly) * Fraction(1e-15)


def test_determinant_that_cancels(rng):
    """Two vectors that span a plane and a third in it, but for its rounding."""
    signs = set()
    for _ in range(1000):
        p, q, base = rng.standard_normal((3, 3))
        third = rng.standard_normal() * (p - base) + rng.standard_normal() * (q - base)
        rows = np.array([(p, base), (q, base), (third, ZERO)])
        exactly = expected(rows)
        got = determinant(*rows.reshape(6, 3))
        assert sign(got) == sign(exactly)
        assert abs(Fraction(got) - exactly) <= abs(exactly) * Fraction(1e-15)
        signs.add(sign(got))
    assert {-1, 1} <= signs


def test_determinant_is_zero_where_it_is(rng):
    for _ in range(200):
        p, q, base = rng.integers(-1000, 1000, (3, 3)) / 64.0
        rows = np.array([(p, base), (q, base), ((p - base) * 3 - (q - base) * 5, ZERO)])
        assert determinant(*rows.reshape(6, 3)) == 0


def test_rounding_stays_below_the_error(rng):
    for rows in rng.standard_normal((1000, 3, 2, 3)):
        rows[2, 0] = rows[0, 0] - rows[0, 1] + rows[2, 0] * 1e-14  # cancels, often
        rows[2, 1] = 0
        value, size = rounded(*(tuple(p - q) for p, q in rows))
        assert abs(Fraction(value) - expected(rows)) <= Fraction(ERROR * size)
