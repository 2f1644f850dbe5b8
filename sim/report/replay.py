"""Recorded rays, traced again by Verilog, model and oracle."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from time import perf_counter

import numpy as np

from sim.cosim.machine import Timing
from sim.cosim.stage import Stage
from sim.model.fp.order import order_key
from sim.model.rays.traversal import NO_TRIANGLE
from sim.oracle.classify import CLASSES
from sim.prepare import Prepared
from sim.report.passes import HIT_FIELDS, check_pass
from sim.report.recording import Recording


@dataclass
class ReplayReport:
    """Figures of a replay. Cycles are of the Verilog.

    `recorded` sorts what the Verilog finds now against what it found then, `model` against what
    the golden model finds, `oracle` against exact first hits of the same mesh.
    """

    scene: str
    format: str
    memory: str
    latency: int
    rays: int
    cycles: int
    cycles_per_ray: float
    recorded: dict[str, int]
    model: dict[str, int]
    oracle: dict
    mismatches: int
    mismatches_shown: list[str]
    wall_seconds: float

    def as_dict(self) -> dict:
        return asdict(self)


def measure_replay(
    recording: Recording,
    prepared: Prepared,
    timing: Timing,
    *,
    step: Callable[[str], None] = lambda _: None,
    tick: Callable[[int], None] = lambda _: None,
) -> ReplayReport:
    """Trace the rays of a recording; `tick` is told how many have ended.

    Raises
    ------
    SimulationError
        The simulator fails.
    """
    config, rays = prepared.config, recording.rays
    step("building the simulator")
    with Stage(prepared, len(rays.t_min), timing) as stage:
        step("simulating")
        begin = perf_counter()
        cast = stage.cast(rays, tick)
        seconds = perf_counter() - begin
        step("checking")
        checked = check_pass("recorded", stage, rays, cast)
    recorded = differences(config.fmt, cast.hits, recording.hits)
    return ReplayReport(
        scene=recording.name,
        format=str(config.fmt),
        memory="dram" if config.cache_words else "banks",
        latency=timing.latency,
        rays=checked.rays,
        cycles=checked.cycles,
        cycles_per_ray=checked.cycles / max(checked.rays, 1),
        recorded=recorded,
        model=differences(config.fmt, cast.hits, checked.expected),
        oracle=checked.oracle,
        mismatches=checked.mismatches + len(rays.t_min) - recorded["same_bits"],
        mismatches_shown=checked.shown,
        wall_seconds=seconds,
    )


def differences(fmt, found: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> dict:
    """Hit records by how they differ: counts of sim.oracle.classify.CLASSES, decided on bits."""
    same = np.all([found[f] == expected[f] for f in HIT_FIELDS], axis=0)
    t, expected_t = (order_key(fmt, hits["t"]) for hits in (found, expected))
    hit, expected_hit = (hits["triangle"] != NO_TRIANGLE for hits in (found, expected))
    kinds = np.select(
        [
            same,
            found["triangle"] == expected["triangle"],
            hit & expected_hit & (t == expected_t),
            ~hit & expected_hit,
            hit & ~expected_hit,
            t < expected_t,
        ],
        range(len(CLASSES) - 1),
        len(CLASSES) - 1,
    )
    return {name: int((kinds == kind).sum()) for kind, name in enumerate(CLASSES)}
