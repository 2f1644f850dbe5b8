"""Frames of a policy, updated and rendered by a core in the Verilog."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hdl.core import Core
from hdl.rays.packet import RAYS
from sim.compiler.rays import View, hits_of, image_fields, scene_fields
from sim.cosim.machine import Machine, Timing
from sim.errors import InputError
from sim.model.rays.camera import Rays
from sim.model.rays.traversal import Hits, trace
from sim.prepare import Prepared
from sim.study.policies.margin import grown_margin
from sim.study.policies.memory import place, room, words_written
from sim.study.policies.plan import Frame, plan
from sim.tree.shape import depth

WORST = 64
"""Cycles that no packet takes at a node, and no ray at a triangle, of a memory of 32 cycles
latency; in proportion of others."""


@dataclass(frozen=True)
class Done:
    """A frame that the Verilog has updated and rendered.

    Attributes
    ----------
    plan : Frame
    expected : Hits
        Of the model.
    program_cycles, render_cycles : int
    host_words : int
        As sim.study.policies.memory.words_written counts them.
    hits : dict of (n,) int64
        Fields t, u, v, triangle of the camera's rays, in their order.
    nodes : (N, limbs) uint32
        Memory words of the nodes after the update.
    """

    plan: Frame
    expected: Hits
    program_cycles: int
    render_cycles: int
    host_words: int
    hits: dict[str, np.ndarray]
    nodes: np.ndarray


def run(
    prepared: Prepared, policy: str, frames: Sequence[int], view: View, rays: Rays
) -> Iterator[Done]:
    """Update and render frames, one after the other, under a policy.

    `rays` are those that the machine makes of the view. The memory has the latency that the
    machine is made for.

    Raises
    ------
    InputError
        There is no such policy, or the machine is too small for the scene, a tree or the rays.
    SimulationError
        The simulator fails.
    """
    config, before = prepared.config, None
    count = RAYS * view.packets
    hits_at = room(prepared)
    prepared.image.check_fits(hits_at + count)
    timing = Timing(latency=config.latency)
    with Machine(config, hits_at + count, timing, unit=Core) as machine:
        for frame in plan(prepared, policy, frames):
            levels = depth(frame.prepared.tree)
            if levels > config.stack_depth:
                raise InputError(
                    f"{prepared.scene.name}: a tree of frame {frame.frame} has {levels} levels and "
                    f"a stack holds {config.stack_depth}"
                )
            margin = grown_margin(config.fmt, frame.growth, view.origin)
            length = len(frame.program)
            job = {
                "program": {"address": place(machine, frame, before), "length": length},
                "casts": 1,
                "cast": {
                    "scene": scene_fields(frame.image, margin),
                    "hits": hits_at,
                    "camera": 1,
                    "image": image_fields(config, view),
                },
            }
            expected = model(frame.prepared, frame.bits, frame.bounds, rays, margin)
            work = expected.counters["steps"] + expected.counters["ray_tests"] + count
            slow = WORST * (1 + timing.latency / 32)
            most = machine.slowest_update(length) + 100_000 + int(slow * work)
            counters = machine.run(job, most)
            cast = counters["cast"]
            yield Done(
                plan=frame,
                expected=expected,
                program_cycles=sum(counters["update"].values()) if length else 0,
                render_cycles=cast["steps"] + sum(cast["waits"].values()),
                host_words=words_written(frame, before),
                hits=hits_of(config, machine.read(hits_at, count)),
                nodes=machine.read(frame.image.nodes_at, frame.image.nodes),
            )
            before = frame


def model(
    prepared: Prepared, bits: np.ndarray, bounds: np.ndarray, rays: Rays, margin: int | None = None
) -> Hits:
    """Hits by the model, of vertices (V, 3) and bounds (N, 4)."""
    return trace(
        prepared.config.fmt,
        prepared.image.order,
        bounds,
        bits[prepared.leaf_vertices],
        rays.origins,
        rays.directions,
        rays.t_min,
        rays.t_max,
        margin=margin,
    )
