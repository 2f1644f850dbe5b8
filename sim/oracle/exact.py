"""Determinants of three vectors without rounding, for the few that rounding would decide."""

import numpy as np
from numba import njit

ERROR = 1e-15
"""A rounded determinant is off by less than this share of its magnitude.

7 roundings of 2^-53 (Shewchuk 1997, orient3d), and some room.
"""


@njit(cache=True)
def rounded(a, b, c):
    """(determinant, magnitude) of three vectors (tuples), rounded.

    The determinant is (a x b) . c, the magnitude what it would be if nothing cancelled.
    """
    p, q = a[1] * b[2], a[2] * b[1]
    value, magnitude = (p - q) * c[0], (abs(p) + abs(q)) * abs(c[0])
    p, q = a[2] * b[0], a[0] * b[2]
    value, magnitude = value + (p - q) * c[1], magnitude + (abs(p) + abs(q)) * abs(c[1])
    p, q = a[0] * b[1], a[1] * b[0]
    return value + (p - q) * c[2], magnitude + (abs(p) + abs(q)) * abs(c[2])


@njit(cache=True)
def two_sum(a, b):
    """The sum and what rounding took from it (Knuth)."""
    total = a + b
    part = total - a
    return total, (a - (total - part)) + (b - part)


@njit(cache=True)
def _halves(a):
    """Two numbers of 26 bits that sum to one of 53 (Veltkamp)."""
    scaled = 134217729.0 * a  # 2^27 + 1
    high = scaled - (scaled - a)
    return high, a - high


@njit(cache=True)
def two_product(a, b):
    """The product and what rounding took from it (Dekker 1971)."""
    product = a * b
    a_high, a_low = _halves(a)
    b_high, b_low = _halves(b)
    rest = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return product, rest


@njit(cache=True)
def _add(expansion, count, x):
    """Add a number to the sum that expansion[:count] stands for; the new count.

    Parts do not overlap and grow, so the last one has the sign of the sum (Shewchuk 1997,
    grow-expansion, zeros left out).
    """
    kept = 0
    for k in range(count):
        x, rest = two_sum(x, expansion[k])
        if rest != 0.0:
            expansion[kept] = rest
            kept += 1
    if x != 0.0:
        expansion[kept] = x
        kept += 1
    return kept


@njit(cache=True)
def _difference(row, p, q):
    """row[:, k] = the two parts of p[k] - q[k]."""
    for k in range(3):
        row[0, k], row[1, k] = two_sum(p[k], -q[k])


@njit(cache=True)
def determinant(a, a_from, b, b_from, c, c_from):
    """((a - a_from) x (b - b_from)) . (c - c_from), the sign exact, the value to 53 bits or so.

    All are (3,) float64. Right as long as no product of three of their bits leaves the range of
    float64: magnitudes from 1e-80 to 1e100 and zeros are safe.
    """
    rows = np.empty((3, 2, 3))
    _difference(rows[0], a, a_from)
    _difference(rows[1], b, b_from)
    _difference(rows[2], c, c_from)
    expansion = np.empty(6 * 8 * 4)  # permutations, high and low parts, parts of a product
    count = 0
    for i in range(3):
        for turn in range(1, 3):
            j, k = (i + turn) % 3, (i + 2 * turn) % 3
            for parts in range(8):
                p, rest = two_product(rows[0, parts & 1, i], rows[1, parts >> 1 & 1, j])
                factor = rows[2, parts >> 2, k]
                if turn == 2:  # an odd permutation
                    factor = -factor
                for term in (p, rest):
                    if term != 0.0 and factor != 0.0:
                        product, low = two_product(term, factor)
                        count = _add(expansion, count, low)
                        count = _add(expansion, count, product)
    total = 0.0
    for k in range(count):
        total += expansion[k]
    return total
