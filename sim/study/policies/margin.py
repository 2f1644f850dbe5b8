"""Boxes that are older than their triangles: by how much rays see them larger."""

from fractions import Fraction

import numpy as np

from hdl.fp.format import FloatFormat
from sim.model.fp.format import decode, encode
from sim.model.rays.setup import margin_scale


def grown_margin(fmt: FloatFormat, growth: float, origin: np.ndarray) -> int:
    """Pattern of a margin by which boxes are larger by `growth` too, for rays from one origin.

    A box grows by margin * (1 + largest |origin|), so the margin is what rounding asks for plus
    growth / (1 + largest |origin|), rounded up: no box is smaller than it has to be.

    Parameters
    ----------
    fmt : FloatFormat
    growth : float
        At least 0.
    origin : (3,) int64 patterns
    """
    reach = 1 + Fraction(float(np.abs(decode(fmt, origin)).max()))
    exact = Fraction(float(decode(fmt, margin_scale(fmt)))) + Fraction(growth) / reach
    bits = int(encode(fmt, float(exact)))
    return bits if decode(fmt, bits) >= exact else bits + 1
