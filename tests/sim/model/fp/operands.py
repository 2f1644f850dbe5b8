"""Operands near each operation's corners: cancelling, next to ties, at the ends of exponents."""

import numpy as np

from hdl.fp.format import FloatFormat
from tests.hdl.fp.operands import near, specials, weighted


def pairs_of_specials(fmt: FloatFormat, rng, count: int, columns: int) -> np.ndarray:
    """Columns of specials, and of numbers of any kind beside them."""
    rows = rng.choice(specials(fmt), (columns, count))
    rows[:, count // 2 :] = np.where(
        rng.random((columns, count - count // 2)) < 0.3,
        weighted(fmt, rng, columns, count - count // 2),
        rows[:, count // 2 :],
    )
    return rows


def number(fmt: FloatFormat, sign, exponent, mantissa) -> np.ndarray:
    """Patterns; exponents that are out of range become the nearest that is not."""
    exponent = np.clip(exponent, 0, (1 << fmt.exp_bits) - 1)
    mantissa = mantissa & ((1 << fmt.man_bits) - 1)
    return sign << (fmt.bits - 1) | exponent << fmt.man_bits | mantissa


def around_a_bit(rng, width: int, at) -> np.ndarray:
    """Mantissas with random bits above bit `at`, and there 100..0, one less, one more or any."""
    high = rng.integers(0, 1 << width, len(at)) >> at + 1 << at + 1
    tail = rng.choice([-1, 0, 0, 1], len(at)) + (1 << at)
    loose = rng.integers(0, 1 << width, len(at)) & ((1 << at + 1) - 1)
    return high | np.where(rng.random(len(at)) < 0.2, loose, tail)


def near_add(fmt: FloatFormat, rng, count: int) -> np.ndarray:
    """Columns a, b: cancelling, or b with a tail below a's last bit that is a tie or next to it."""
    third = count // 3
    cancelling = near(fmt, rng, third, 2).T
    cancelling[1] ^= (rng.random(third) < 0.8).astype(np.int64) << (fmt.bits - 1)
    rest = count - third
    a = weighted(fmt, rng, 1, rest)[0]
    distance = rng.integers(-1, fmt.man_bits + 5, rest)
    mantissa = around_a_bit(rng, fmt.man_bits, (distance - 1).clip(0, fmt.man_bits))
    exponent = (a >> fmt.man_bits & ((1 << fmt.exp_bits) - 1)) - distance
    return np.hstack([cancelling, [a, number(fmt, rng.integers(0, 2, rest), exponent, mantissa)]])


def near_mul(fmt: FloatFormat, rng, count: int) -> np.ndarray:
    """Columns a, b: products of few bits, ties among them, near the ends of exponents or not."""
    bits = rng.integers(0, fmt.man_bits + 1, count)
    ends = np.array([0, fmt.bias, fmt.bias, 2 * fmt.bias + 1])
    total = rng.choice(ends, count) + fmt.bias + rng.integers(-2, 3, count)
    any_exponent = rng.integers(0, 1 << fmt.exp_bits, count)
    columns = []
    for length, exponent in [(bits, any_exponent), (fmt.man_bits - bits + 1, total - any_exponent)]:
        length = length.clip(0, fmt.man_bits)
        mantissa = rng.integers(0, 1 << fmt.man_bits, count) >> fmt.man_bits - length
        mantissa <<= fmt.man_bits - length
        mantissa += rng.choice([0, 0, 0, 1, -1], count)
        columns.append(number(fmt, rng.integers(0, 2, count), exponent, mantissa))
    return np.array(columns)


def near_cross(fmt: FloatFormat, rng, count: int) -> np.ndarray:
    """Columns a to d: the products equal, some ulps apart, or at any distance of a tie."""
    half = count // 2
    a, b = weighted(fmt, rng, 2, half)
    rows = np.array([a, b, b, a])
    for column in rows[2:]:  # c and d are b and a, ulps away
        column += rng.choice([0, 0, 0, 1, -1, 2], half)
        column &= (1 << fmt.bits) - 1
    shift = rng.integers(-3, 4, half) << fmt.man_bits
    rows[2:] += np.array([shift, -shift])
    rows &= (1 << fmt.bits) - 1
    rows[3] ^= (rng.random(half) < 0.1).astype(np.int64) << (fmt.bits - 1)

    rest = count - half
    a, b = near_mul(fmt, rng, rest)
    sum_ab = sum(v >> fmt.man_bits & ((1 << fmt.exp_bits) - 1) for v in (a, b))
    c, d = near_mul(fmt, rng, rest)
    exponent_c = c >> fmt.man_bits & ((1 << fmt.exp_bits) - 1)
    distance = rng.integers(-2 * fmt.man_bits - 4, 2 * fmt.man_bits + 5, rest)
    d = number(fmt, d >> (fmt.bits - 1), sum_ab - distance - exponent_c, d)
    return np.hstack([rows, [a, b, c, d]])


def classes(fmt: FloatFormat, rng, count: int, columns: int, corners) -> dict[str, np.ndarray]:
    """Columns of `count` rows of each of three classes; `corners` makes the second."""
    return {
        "specials": pairs_of_specials(fmt, rng, count, columns),
        "near": corners(fmt, rng, count),
        "weighted": weighted(fmt, rng, columns, count),
    }


def every(fmt: FloatFormat, columns: int) -> np.ndarray:
    """Columns of all there are."""
    return np.indices((1 << fmt.bits,) * columns).reshape(columns, -1)
