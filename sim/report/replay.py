"""Recorded rays, traced again by Verilog, model and oracle."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from time import perf_counter

from sim.compiler.rays import check_rays
from sim.cosim.machine import Timing
from sim.cosim.stage import Stage
from sim.prepare import Prepared
from sim.report.passes import check_pass, class_counts, differences, oracle_figures
from sim.report.recording import Recording, by_scene


@dataclass
class ReplayReport:
    """Figures of a replay. Cycles are of the Verilog.

    `recorded` sorts what the Verilog finds now against what it found then, `model` against what
    the golden model finds, `oracle` against exact first hits of the same mesh. Which of two
    triangles that are equally far a ray hits goes by the order of the leaves, which is not the same
    in all machines: these are no mismatches.
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
    check_rays(config, source=True)
    step("building the simulator")
    with Stage(prepared, len(rays.t_min), timing) as stage:
        step("simulating")
        begin = perf_counter()
        cast = stage.cast(rays, tick)
        seconds = perf_counter() - begin
        step("checking")
        checked = check_pass("recorded", stage, rays, cast)
    now = by_scene(prepared, cast.hits)
    recorded = class_counts(differences(config.fmt, now, recording.hits))
    return ReplayReport(
        scene=recording.name,
        format=str(config.fmt),
        memory="dram" if config.cache_words else "banks",
        latency=timing.latency,
        rays=checked.rays,
        cycles=checked.cycles,
        cycles_per_ray=checked.cycles / max(checked.rays, 1),
        recorded=recorded,
        model=checked.model,
        oracle=oracle_figures([checked.oracle]),
        mismatches=checked.mismatches + len(rays.t_min) - recorded["same_bits"] - recorded["tie"],
        mismatches_shown=checked.shown,
        wall_seconds=seconds,
    )
