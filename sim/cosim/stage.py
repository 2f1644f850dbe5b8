"""A scene in the memory of a simulated core: updated to its frames, and rays cast through it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdl.core import Core
from hdl.rays.packet import RAYS
from sim.compiler.rays import (
    View,
    camera_fields,
    hits_of,
    memory_fields,
    ray_words,
    scene_fields,
)
from sim.cosim.machine import Machine, Timing
from sim.errors import UnfitError
from sim.model.rays.camera import Rays
from sim.model.rays.traversal import Hits
from sim.pose import Pose, pose_of
from sim.prepare import Prepared

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
    pose : Pose
        What is on it now; its words are what those in memory should be.
    sent : int
        Words that the host wrote for the last frame.

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
        self.pose = self._posed(prepared, prepared.frames[0] if frame is None else frame)
        self.sent = 0
        image = self.pose.image
        self._rays_at = image.size
        self._hits_at = image.size + (2 * rays if prepared.config.source else 0)
        image.check_fits(self._hits_at + rays)
        self.machine = Machine(
            prepared.config, self._hits_at + rays, timing, waves=waves, unit=Core
        )
        self.machine.write(0, self.pose.words)

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.machine.__exit__(*exception)

    @staticmethod
    def _posed(prepared: Prepared, frame: int) -> Pose:
        pose, held = pose_of(prepared, frame), prepared.config.stack_depth
        levels = pose.prepared.levels
        if levels > held:
            raise UnfitError(
                f"{prepared.scene.name}: its tree has {levels} levels and a stack holds {held}: "
                f"stack_depth has to be {levels}; use --stack {levels}"
            )
        return pose

    def show(self, frame: int) -> dict | None:
        """Update to the pose of a frame. The core's counters; None where nothing has moved.

        The host writes the words that change: of vertices and rows, and where a part has another
        tree those of program, triangles and links. `sent` says how many.

        Raises
        ------
        InputError
            A vertex has moved, and the machine does not update trees.
        """
        before, self.pose = self.pose, self._posed(self.pose.prepared, frame)
        prepared, image = self.pose.prepared, self.pose.image
        written = self.pose.before_update(before.bounds)
        if (written != before.words).any():
            prepared.check_updates(frame)
        self.sent = self.machine.change(before.words, written)
        if not self.sent:
            return None
        length = len(image.instructions)
        job = {
            "program": {"address": 0, "length": length},
            "casts": 0,
            "cast": {"scene": scene_fields(image, prepared.margin)},
        }
        return self.machine.run(job, self.machine.slowest_update(length))

    def model(self, rays: Rays) -> Hits:
        """What the model makes of rays."""
        pose = self.pose
        return pose.prepared.trace(pose.bits, pose.rows, pose.bounds, rays)

    def look(self, view: View, tick: Callable[[int], None] = lambda _: None) -> Cast:
        """Cast the rays of a camera: those of sim.model.rays.camera, in their order.

        Now and then `tick` is told how many rays have ended.
        """
        count = RAYS * view.packets
        return self._cast(camera_fields(self.machine.config, view), count, tick)

    def cast(self, rays: Rays, tick: Callable[[int], None] = lambda _: None) -> Cast:
        """Cast rays from memory, a multiple of 4; as `look`."""
        config, count = self.machine.config, len(rays.t_min)
        fields = memory_fields(config, self._rays_at, count // RAYS)
        words = ray_words(config, rays.origins, rays.directions, rays.t_min, rays.t_max)
        self.machine.write(self._rays_at, words)
        return self._cast(fields, count, tick)

    def _cast(self, fields: dict, count: int, tick: Callable[[int], None]) -> Cast:
        timing, prepared = self.machine.timing, self.pose.prepared
        slow = WORST * (1 + timing.latency / 32) / (1 - timing.stalls) ** 2
        job = {
            "casts": 1,
            "cast": {
                "scene": scene_fields(prepared.image, prepared.margin),
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
        return Cast(hits_of(prepared.config, words), counters)
