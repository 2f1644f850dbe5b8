"""Where an instance is: its matrix as the machine holds it, its box, and how sure its rays are."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hdl.fp.format import FloatFormat
from sim.model.fp.format import decode, encode
from sim.model.fp.order import from_key, order_key
from sim.model.rays.setup import ROUNDING_ULPS

ORIGIN_ROUNDINGS, DIRECTION_ROUNDINGS = 4, 3
"""Of a coordinate of an object's ray: a product, and sums of three or of two more."""


@dataclass(frozen=True)
class Frame:
    """The frame of an object, in which it fills [-1, 1]: rest = centre + 2**exponent * point."""

    centre: np.ndarray
    exponent: int

    def points(self, rest: np.ndarray) -> np.ndarray:
        """Points (..., 3) at rest in this frame."""
        return np.ldexp(rest - self.centre, -self.exponent)

    def matrix(self) -> np.ndarray:
        """(3, 4) from this frame to rest."""
        return np.column_stack([np.eye(3) * 2.0**self.exponent, self.centre])


def frame_of(rest: np.ndarray) -> Frame:
    """The frame of an object at rest (n, 3)."""
    low, high = rest.min(axis=0), rest.max(axis=0)
    centre = (low + high) / 2
    extent = max((high - centre).max(), (centre - low).max())
    return Frame(centre, int(np.frexp(extent)[1]) if extent else 0)


def after(placement: np.ndarray, before: np.ndarray) -> np.ndarray:
    """The map (3, 4) that places what another one has placed."""
    joined = placement[:, :3] @ before
    joined[:, 3] += placement[:, 3]
    return joined


def rows_of(fmt: FloatFormat, placement: np.ndarray) -> np.ndarray:
    """Rows (..., 3, 4) in bit patterns, which take points of the world into an object's frame.

    Of matrices (..., 3, 4) that take them back; each number is rounded once.
    """
    inverse = np.linalg.inv(placement[..., :3])
    offset = -(inverse @ placement[..., 3:])
    return encode(fmt, np.concatenate([inverse, offset], axis=-1))


@dataclass(frozen=True)
class Placed:
    """An object where the machine's rows (3, 4) put it: rounded, and exact from there on.

    Parameters
    ----------
    fmt : FloatFormat
    rows : (3, 4) int64 bit patterns
    points : (n, 3) float64
        Of the object, as the machine holds them.
    """

    fmt: FloatFormat
    rows: np.ndarray
    points: np.ndarray

    @cached_property
    def _inverse(self) -> tuple[np.ndarray, np.ndarray]:
        held = decode(self.fmt, self.rows)
        return np.linalg.inv(held[:, :3]), held

    @cached_property
    def world(self) -> np.ndarray:
        """The points (n, 3) in the world."""
        inverse, held = self._inverse
        return (self.points - held[:, 3]) @ inverse.T

    def box(self) -> np.ndarray:
        """Lowest and highest corner (2, 3) in bit patterns, rounded outward."""
        ends = np.stack([self.world.min(axis=0), self.world.max(axis=0)])
        bits = encode(self.fmt, ends)
        off = decode(self.fmt, bits) - ends
        keys = order_key(self.fmt, bits)
        keys[0] -= off[0] > 0
        keys[1] += off[1] < 0
        return from_key(self.fmt, keys)

    def rounding(self) -> float:
        """Half ulps, of 1 + a ray's largest coordinate, by which a hit may lie off on an axis.

        With u = half an ulp of 1, R = 1 + the largest coordinate of the ray's origin, and rows
        |m|, |c| of the matrix: a coordinate of the origin is a sum of four terms, each rounded
        at most ORIGIN_ROUNDINGS times, so it is off by 4u (|m| R + |c|). The direction is off by
        3u |m| |d|, and at a hit, which lies in [-1, 1], t |d| <= R on each axis. There the triangle
        test, in the object's frame, is off by ROUNDING_ULPS u (1 + |m| R + |c|). All of it goes
        back through the inverse. With R >= 1 this is at most the result times u R.
        """
        inverse, held = self._inverse
        reach = np.abs(held[:, :3]).sum(axis=1)
        offset = np.abs(held[:, 3])
        ray = ORIGIN_ROUNDINGS * (reach + offset) + DIRECTION_ROUNDINGS * reach
        test = ROUNDING_ULPS * (1 + reach + offset)
        return float((np.abs(inverse) @ (ray + test)).max())
