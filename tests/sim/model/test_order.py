"""sim.model.fp.order against the order of exact values."""

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from sim.model.fp.order import from_key, maximum, minimum, order_key
from tests import oracle

TINY = [FloatFormat(2, 1), FloatFormat(3, 2)]
FORMATS = [*TINY, FloatFormat(4, 9), F24, FloatFormat(8, 23)]


def pairs(fmt, rng):
    """All pairs of patterns of a tiny format, canonical or not; else a sample with neighbours."""
    if fmt in TINY:
        return np.indices((1 << fmt.bits, 1 << fmt.bits)).reshape(2, -1)
    a = rng.integers(0, 1 << fmt.bits, 5_000)
    special = oracle.pattern(fmt, 0, np.array([0, 1, 2**fmt.exp_bits - 2, 2**fmt.exp_bits - 1]), 0)
    a[:1000] = rng.choice(special, 1000) + rng.integers(0, 2, 1000)
    b = a ^ rng.choice([0, 1, 1 << (fmt.bits - 1), 1 << fmt.man_bits], 5_000)
    other = rng.random(5_000) < 0.5
    b[other] = rng.permutation(a)[other]
    return np.stack([a, b])


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_keys_minimum_and_maximum_of_pairs(fmt, rng):
    a, b = pairs(fmt, rng)
    low, high = minimum(fmt, a, b), maximum(fmt, a, b)
    less = order_key(fmt, a) < order_key(fmt, b)
    for k, (p, q) in enumerate(zip(a.tolist(), b.tolist(), strict=True)):
        assert less[k] == (oracle.order(fmt, p) < oracle.order(fmt, q)), f"{p:#x} < {q:#x}"
        assert low[k] == oracle.low(fmt, p, q), f"minimum of {p:#x}, {q:#x}"
        assert high[k] == oracle.high(fmt, p, q), f"maximum of {p:#x}, {q:#x}"
    assert (low == minimum(fmt, b, a)).all() and (high == maximum(fmt, b, a)).all()
    assert (less ^ (order_key(fmt, b) < order_key(fmt, a)) ^ (a == b)).all()


@pytest.mark.parametrize("fmt", [*TINY, FloatFormat(4, 9)], ids=str)
def test_order_is_total_over_all_patterns(fmt):
    """In the oracle's order, keys count up one by one; and back."""
    patterns = np.array(sorted(range(1 << fmt.bits), key=lambda bits: oracle.order(fmt, bits)))
    half = 1 << (fmt.bits - 1)
    keys = np.arange(-half, half)
    assert (order_key(fmt, patterns) == keys).all()
    assert (from_key(fmt, keys) == patterns).all()


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_from_key_is_the_inverse(fmt, rng):
    patterns = rng.integers(0, 1 << fmt.bits, (1_000, 4))
    assert (from_key(fmt, order_key(fmt, patterns)) == patterns).all()


def test_zeros_and_infinities_in_order():
    fmt = FloatFormat(3, 2)
    numbers = [0b1_111_00, 0b1_110_11, 0b1_001_00, 0b1_000_00]  # -inf, -14, -1/4, -0
    numbers += [bits & 0b0_111_11 for bits in reversed(numbers)]
    assert order_key(fmt, np.array(numbers)).tolist() == sorted(order_key(fmt, np.array(numbers)))
    assert minimum(fmt, 0b0_000_00, 0b1_000_00) == 0b1_000_00
    assert maximum(fmt, 0b1_000_00, 0b0_000_00) == 0
