"""Operands that meet the corners of a float format, as bit patterns."""

import itertools

import numpy as np

from hdl.fp.format import FloatFormat
from sim.model.fp.order import from_key, order_key


def specials(fmt: FloatFormat) -> np.ndarray:
    """Zeros, infinities, ones, smallest and largest of both signs; zero, infinity not canonical."""
    top, ones = (1 << fmt.exp_bits) - 1, (1 << fmt.man_bits) - 1
    magnitudes = [
        *(exponent << fmt.man_bits for exponent in (0, 1, fmt.bias, top)),
        *(exponent << fmt.man_bits | ones for exponent in (0, 1, top - 1, top)),
    ]
    signs = (0, 1 << (fmt.bits - 1))
    return np.array([sign | m for sign in signs for m in magnitudes], np.int64)


def near(fmt: FloatFormat, rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Rows of numbers within two ulps of each other, some with the other sign."""
    centre = order_key(fmt, weighted(fmt, rng, rows, 1))
    keys = centre + rng.integers(-2, 3, (rows, columns))
    most = 1 << (fmt.bits - 1)
    bits = from_key(fmt, keys.clip(-most, most - 1))
    return bits ^ (rng.random((rows, columns)) < 0.1).astype(np.int64) << (fmt.bits - 1)


def weighted(fmt: FloatFormat, rng: np.random.Generator, rows: int, columns: int) -> np.ndarray:
    """Rows of random numbers: in half of them, exponents from the ends and the middle."""
    size = (rows, columns)
    top, ones = (1 << fmt.exp_bits) - 1, (1 << fmt.man_bits) - 1
    ends = np.array([0, 1, fmt.bias - 1, fmt.bias, top - 1, top])
    exponent = np.where(
        rng.random(size) < 0.5, rng.choice(ends, size), rng.integers(0, top + 1, size)
    )
    edges = np.array([0, 1, ones - 1, ones]) & ones
    mantissa = np.where(
        rng.random(size) < 0.25, rng.choice(edges, size), rng.integers(0, ones + 1, size)
    )
    return rng.integers(0, 2, size) << (fmt.bits - 1) | exponent << fmt.man_bits | mantissa


def operands(fmt: FloatFormat, rng: np.random.Generator, columns: int, count: int) -> np.ndarray:
    """Rows of operands: all there are, if at most 4096, else `count` of each of three classes.

    The classes are special with special, near each other, and random with weighted exponents.
    """
    if fmt.bits * columns <= 12:
        return np.array(list(itertools.product(range(1 << fmt.bits), repeat=columns)))
    corners = specials(fmt)
    crossed = rng.choice(corners, (count, columns))
    if len(corners) ** columns <= count:
        crossed = np.array(list(itertools.product(corners, repeat=columns)))
    return np.concatenate([
        crossed,
        near(fmt, rng, count, columns),
        weighted(fmt, rng, count, columns),
    ])
