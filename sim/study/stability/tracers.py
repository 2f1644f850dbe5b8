"""Who traces rays in this study, each by the same three calls: the machine and its peers."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import numpy as np

from hdl.config import FULL
from hdl.fp.format import FloatFormat
from hdl.rays.packet import NO_TRIANGLE, RAYS
from sim.errors import InputError
from sim.model.fp.format import decode, encode
from sim.model.rays.traversal import trace
from sim.model.refit import refit
from sim.prepare import prepare
from sim.scene.scene import Scene

SYSTEMS = {
    "ours": "ours",
    "embree": "Embree",
    "embree_robust": "robust",
    "warp": "warp",
}
"""Names in results and in tables."""


@dataclass(frozen=True)
class Found:
    """First hits: t (n,) float64 in directions, triangle (n,) int64, -1 for none."""

    t: np.ndarray
    triangle: np.ndarray


class Tracer(Protocol):
    """A mesh as a system holds it, in numbers and coordinates of its own.

    Attributes
    ----------
    vertices : (V, 3) float64
        What its vertices have become.
    rank : (T,) int
        Of hits at equal t that of the lowest rank counts, if the system promises it.
    """

    vertices: np.ndarray
    rank: np.ndarray

    def points(self, points: np.ndarray) -> np.ndarray:
        """Points (n, 3) of the user as the system holds them."""
        ...

    def directions(self, directions: np.ndarray) -> np.ndarray:
        """Directions (n, 3) as the system holds them: the scale of its coordinates is left out."""
        ...

    def first(self, origins: np.ndarray, directions: np.ndarray) -> Found:
        """First hits with t >= 0 of rays that it holds."""
        ...


Make = Callable[[np.ndarray, np.ndarray], Tracer]
"""From vertices (V, 3) float64 and faces (T, 3) to a tracer of them."""


class Machine:
    """The golden model: its bits are those of the Verilog. Holds what `Normalised.points` makes.

    Raises
    ------
    InputError
        The mesh is not finite, or the format too narrow for it.
    """

    def __init__(self, fmt: FloatFormat, vertices: np.ndarray, faces: np.ndarray):
        scene = Scene("mesh", np.asarray(faces, np.int32), 1, lambda _: vertices)
        self._fmt = fmt
        self._prepared = prepare(scene, replace(FULL, fmt=fmt))
        bits = self._prepared.coordinates(0)
        self._corners = bits[self._prepared.leaf_vertices]
        self._bounds = refit(fmt, self._prepared.image.order, self._corners)
        self.vertices = decode(fmt, bits)
        self.rank = np.argsort(self._prepared.image.order.triangles)

    def points(self, points: np.ndarray) -> np.ndarray:
        """Normalised as the scene is, and rounded once."""
        return self.directions(self._prepared.normalised.points(points))

    def directions(self, directions: np.ndarray) -> np.ndarray:
        """Rounded once."""
        return decode(self._fmt, encode(self._fmt, directions))

    def first(self, origins: np.ndarray, directions: np.ndarray) -> Found:
        """By sim.model.rays.traversal; t in directions of the normalised scene."""
        fmt, count = self._fmt, len(origins)
        order = self._prepared.image.order
        there = np.arange(-(-count // RAYS) * RAYS) < count  # whole packets
        rays = [encode(fmt, np.resize(x, (len(there), 3))) for x in (origins, directions)]
        limits = [encode(fmt, np.where(there, *t)) for t in ((0.0, np.inf), (np.inf, -np.inf))]
        hits = trace(fmt, order, self._bounds, self._corners, *rays, *limits)
        found = hits.triangle[:count] != NO_TRIANGLE
        record = np.where(found, hits.triangle[:count], 0)
        return Found(decode(fmt, hits.t[:count]), np.where(found, order.triangles[record], -1))


def systems(fmt: FloatFormat, peers: bool) -> dict[str, Make]:
    """By name, how a tracer of each system is made.

    Raises
    ------
    InputError
        The peers are wanted and not installed.
    """
    ours: dict[str, Make] = {"ours": partial(Machine, fmt)}
    if not peers:
        return ours
    try:
        from sim.study.stability.embree import Embree
        from sim.study.stability.warp import Warp
    except ImportError as error:
        raise InputError("--peers needs Embree and warp: pip install 'bkdtree[peers]'") from error
    return {
        **ours,
        "embree": partial(Embree, False),
        "embree_robust": partial(Embree, True),
        "warp": Warp,
    }
