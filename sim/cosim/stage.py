"""A scene in the memory of a simulated core: updated to its frames, and rays cast through it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdl.core import Core
from hdl.rays.packet import RAYS
from sim.compiler.partial import corner_words
from sim.compiler.rays import (
    View,
    camera_fields,
    hits_of,
    memory_fields,
    ray_words,
    scene_fields,
)
from sim.cosim.machine import Machine, Timing
from sim.errors import InputError
from sim.model.rays.camera import Rays
from sim.model.rays.traversal import Hits
from sim.model.refit import box_corners, refit
from sim.model.update import execute
from sim.prepare import Prepared
from sim.tree.shape import depth

WORST = 2000
"""Cycles a ray that no job takes, of a memory of 32 cycles latency; in proportion of others."""


@dataclass(frozen=True)
class Cast:
    """What a job of rays came to.

    Attributes
    ----------
    hits : dict of (n,) int64
        Fields t, u, v, triangle of the rays in their order, by name.
    counters : dict
        Of hdl.core.
    """

    hits: dict[str, np.ndarray]
    counters: dict


class Stage:
    """A scene on a core, with vertices and bounds of a frame. A context manager, as its machine is.

    Parameters
    ----------
    prepared : Prepared
    rays : int
        Most that are cast at once, a multiple of 4.
    timing : Timing
        Of the memory.
    waves : Path, optional
        FST file.
    frame : int, optional
        The first, if it is not said.

    Attributes
    ----------
    prepared : Prepared
    memory : (n, limbs) uint32
        What the words of the scene should be.
    bits, rows, bounds : int64 patterns
        Points (V, 3) of the scene, rows (I, 3, 4) of its instances, and bounds (N, 4) of the
        nodes, now.

    Raises
    ------
    InputError
        The format is too narrow for the frame, the memory too small for scene and rays, or a
        stack for the levels of the tree.
    SimulationError
        The simulator fails.
    """

    def __init__(
        self,
        prepared: Prepared,
        rays: int,
        timing: Timing,
        waves: Path | None = None,
        frame: int | None = None,
    ):
        image, held = prepared.image, prepared.config.stack_depth
        levels = depth(prepared.tree)
        if levels > held:
            raise InputError(
                f"{prepared.scene.name}: its tree has {levels} levels and a stack holds {held}: "
                f"stack_depth has to be {levels}; use --stack {levels}"
            )
        self.prepared = prepared
        self.memory = image.constant_words()
        self._pose(prepared.frames[0] if frame is None else frame)
        self.sent = 0
        self._rays_at = image.size
        self._hits_at = image.size + (2 * rays if prepared.config.source else 0)
        image.check_fits(self._hits_at + rays)
        self.machine = Machine(
            prepared.config, self._hits_at + rays, timing, waves=waves, unit=Core
        )
        self.machine.write(0, self.memory)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.machine.__exit__(*exception)

    def _pose(self, frame: int):
        prepared, image = self.prepared, self.prepared.image
        self.bits, self.rows = prepared.coordinates(frame), prepared.rows(frame)
        self.bounds = refit(prepared.config.fmt, image.order, self.bits[prepared.leaf_vertices])
        self.memory[image.vertices_at : image.rows_at] = image.vertex_words(self.bits)
        self.memory[image.rows_at : image.triangles_at] = image.row_words(self.rows)
        self.memory[image.nodes_at : image.still_at] = image.node_words(self.bounds)
        fmt, leaves = prepared.config.fmt, self.bits[prepared.leaf_vertices]
        self.memory[image.still_at :] = corner_words(fmt, box_corners(fmt, leaves, image.still))

    def show(self, frame: int) -> dict | None:
        """Update to the pose of a frame. The core's counters; None where nothing has moved.

        The host writes the words that change: of vertices and rows, and where a part has another
        tree those of program, triangles and links. `sent` says how many.

        Raises
        ------
        InputError
            A vertex has moved, and the machine does not update trees.
        """
        before = self.memory
        self.prepared = self.prepared.at(frame)
        image = self.prepared.image
        self.memory = image.constant_words()
        self._pose(frame)
        written = self.memory.copy()
        nodes = slice(image.nodes_at, image.still_at)
        written[nodes] = image.node_words(self._stale(image.bounds_of(before[nodes])))
        changed = (written != before).any(axis=1)
        self.sent = int(changed.sum())
        if not self.sent:
            return None
        self.prepared.check_updates(frame)
        for begin, end in _runs(changed):
            self.machine.write(begin, written[begin:end])
        length = len(image.instructions)
        job = {
            "program": {"address": 0, "length": length},
            "casts": 0,
            "cast": {"scene": scene_fields(image, self.prepared.margin)},
        }
        return self.machine.run(job, self.machine.slowest_update(length))

    def model(self, rays: Rays) -> Hits:
        """What the model makes of rays."""
        return self.prepared.trace(self.bits, self.rows, self.bounds, rays)

    def _stale(self, bounds: np.ndarray) -> np.ndarray:
        """Bounds (N, 4) of the nodes before an update: what it writes is still as in `bounds`."""
        config, image = self.prepared.config, self.prepared.image
        records = np.zeros((image.records, 3), np.int64)
        none = np.full_like(bounds, (1 << config.fmt.bits) - 1)
        writes = execute(config, image.instructions, records, none)
        return np.where(writes != none, bounds, self.bounds)

    def look(self, view: View, tick: Callable[[int], None] = lambda _: None) -> Cast:
        """Cast the rays of a camera: those of sim.model.rays.camera, in their order.

        Now and then `tick` is told how many rays have ended.
        """
        count = RAYS * view.packets
        return self._cast(camera_fields(self.prepared.config, view), count, tick)

    def cast(self, rays: Rays, tick: Callable[[int], None] = lambda _: None) -> Cast:
        """Cast rays from memory, a multiple of 4; as `look`."""
        config, count = self.prepared.config, len(rays.t_min)
        fields = memory_fields(config, self._rays_at, count // RAYS)
        words = ray_words(config, rays.origins, rays.directions, rays.t_min, rays.t_max)
        self.machine.write(self._rays_at, words)
        return self._cast(fields, count, tick)

    def _cast(self, fields: dict, count: int, tick: Callable[[int], None]) -> Cast:
        timing = self.machine.timing
        slow = WORST * (1 + timing.latency / 32) / (1 - timing.stalls) ** 2
        job = {
            "casts": 1,
            "cast": {
                "scene": scene_fields(self.prepared.image, self.prepared.margin),
                "hits": self._hits_at,
                **fields,
            },
        }
        counters = self.machine.run(
            job,
            100_000 + int(slow * count),
            lambda counters: tick(RAYS * counters["cast"]["packets"]),
        )
        words = self.machine.read(self._hits_at, count)
        return Cast(hits_of(self.prepared.config, words), counters)


def _runs(changed: np.ndarray) -> list[tuple[int, int]]:
    """Where words (n,) that change begin and end."""
    edges = np.flatnonzero(np.diff(changed, prepend=False, append=False))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
