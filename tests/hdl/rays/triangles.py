"""Rays and triangles that meet the corners of the triangle test, as bit patterns.

Each function gives origins (n, 3), directions (n, 3) and triangles (n, 3, 3).
"""

import numpy as np

from hdl.fp.format import FloatFormat
from sim.model.fp.format import encode
from tests.hdl.fp.operands import operands


def grid(fmt: FloatFormat, rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles and origins on a grid, and rays at corners, edges and insides.

    Many triangles are degenerate, many origins lie on them, many directions have zeros of
    either sign. Some scenes are as large or as small as the format allows.
    """
    triangles = rng.integers(-2, 3, (count, 3, 3)) / 2.0
    origins = rng.integers(-2, 3, (count, 3)) / 2.0
    weights = rng.choice([0.0, 0.0, 0.25, 0.5, 1.0], (count, 3))
    weights[weights.sum(axis=1) == 0] = 1.0
    weights /= weights.sum(axis=1, keepdims=True)
    directions = np.einsum("nk,nka->na", weights, triangles) - origins
    scale = 2.0 ** rng.integers(fmt.min_exp, fmt.max_exp + 1, (3, count, 1))
    scale[:, rng.random(count) < 0.7] = 1.0
    scale[1] = np.where(rng.random((count, 1)) < 0.7, scale[0], scale[1])
    bits = [
        encode(fmt, x * s)
        for x, s in ((origins, scale[0]), (directions, scale[2]), (triangles, scale[1][:, None]))
    ]
    for x in bits:  # zeros of either sign
        x[(x == 0) & (rng.random(x.shape) < 0.5)] = 1 << (fmt.bits - 1)
    return bits[0], bits[1], bits[2]


def inside(fmt: FloatFormat, rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles of any size and place, and rays at about a point of theirs."""
    size = 2.0 ** -rng.integers(0, 12, (count, 1, 1))
    triangles = rng.uniform(-1, 1, (count, 1, 3)) + size * rng.uniform(-1, 1, (count, 3, 3))
    origins = rng.uniform(-1, 1, (count, 3))
    targets = np.einsum("nk,nka->na", rng.dirichlet([0.5] * 3, count), triangles)
    return encode(fmt, origins), encode(fmt, targets - origins), encode(fmt, triangles)


def anything(fmt: FloatFormat, rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bit patterns: special ones, near each other, and random."""
    x = operands(fmt, rng, 15, count // 3)
    return x[:, :3], x[:, 3:6], x[:, 6:].reshape(-1, 3, 3)
