"""Frames of a scene, updated and rendered in the Verilog, checked and measured."""

from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from functools import partial
from time import perf_counter

import numpy as np

from sim.compiler.rays import check_rays
from sim.cosim.machine import Timing
from sim.cosim.stage import Cast, Stage
from sim.model.rays.camera import Rays
from sim.prepare import Prepared, view_of
from sim.report import pixels
from sim.report.mismatch import SHOWN, describe_all
from sim.report.passes import Pass, check_pass, oracle_figures, total
from sim.report.seen import Seen
from sim.scene.camera import Camera


@dataclass
class RenderReport:
    """Figures of a run, of all frames together; a list has one entry a frame.

    Cycles are of the Verilog. `cycles` are of rays; `update_cycles` are beside them, and
    `update_share` is theirs of both. `updates` counts the frames that needed an update: those
    whose vertices are not where they were; `words_sent` are the memory words that the host wrote
    for them. Figures a ray are of all `rays`, shadow rays among
    them; `hit_fraction` is of the camera's. `overflows` counts, for each place in the machine, the
    runs in which finite numbers became infinite there.
    """

    scene: str
    triangles: int
    frames: list[int]
    size: tuple[int, int]
    format: str
    memory: str
    latency: int
    cache_words: int
    rays: int = 0
    shadow_rays: int = 0
    cycles: int = 0
    cycles_per_ray: float = 0.0
    cycles_per_frame: list[int] = field(default_factory=list)
    steps_per_packet: float = 0.0
    triangle_tests_per_ray: float = 0.0
    hit_fraction: float = 0.0
    model_mismatches: int = 0
    mismatches_shown: list[str] = field(default_factory=list)
    overflows: dict[str, int] = field(default_factory=dict)
    oracle: dict = field(default_factory=dict)
    updates: int = 0
    words_sent: int = 0
    update_cycles: int = 0
    update_share: float = 0.0
    cache: dict[str, dict[str, int]] = field(default_factory=dict)
    stall_cycles: dict[str, dict[str, int]] = field(default_factory=dict)
    wall_seconds: float = 0.0
    model_rays_per_second: float = 0.0
    simulated_cycles_per_second: float = 0.0

    def as_dict(self) -> dict:
        return asdict(self)


@dataclass(frozen=True)
class Watch:
    """Who is told what of a run.

    Attributes
    ----------
    step : callable
        What begins.
    tick : callable
        How many frames are done, with what is done of the next.
    paint : callable
        What each frame's pixels see, and which of them the lamp reaches (None without shadows).
    record : callable
        All rays that were cast, with what they came to.
    """

    step: Callable[[str], None] = lambda _: None
    tick: Callable[[float], None] = lambda _: None
    paint: Callable[[Seen, np.ndarray | None], None] = lambda *_: None
    record: Callable[[Stage, Rays, Cast], None] = lambda *_: None


def measure_render(
    prepared: Prepared,
    timing: Timing,
    camera: Camera,
    frames: range,
    *,
    lamp: np.ndarray | None = None,
    watch: Watch = Watch(),
) -> RenderReport:
    """Render frames in the Verilog; compare every hit and all of the scene's memory.

    In memory are the vertices and bounds of the first frame that was prepared: a frame is updated
    if its vertices are not those in memory. A machine that updates no tree begins with those of
    the first frame that it renders.

    Parameters
    ----------
    prepared : Prepared
        With all of `frames` among its frames.
    timing : Timing
        Of the memory.
    camera : Camera
        In normalised coordinates.
    frames : range
    lamp : (3,) float64, optional
        Cast a ray from each hit to it too, for shadows.
    watch : Watch

    Raises
    ------
    SimulationError
        The simulator fails.
    InputError
        The configuration is too small for the scene.
    """
    config = prepared.config
    check_rays(config, camera=True, source=lamp is not None)
    report = RenderReport(
        scene=prepared.scene.name,
        triangles=len(prepared.scene.faces),
        frames=list(frames),
        size=(camera.width, camera.height),
        format=str(config.fmt),
        memory="dram" if config.cache_words else "banks",
        latency=timing.latency,
        cache_words=config.cache_words,
    )
    view = view_of(config.fmt, camera)
    rays = pixels.camera_rays(config.fmt, view)
    first = None if config.update else _only_pose(prepared, frames)
    watch.step("building the simulator")
    with Stage(prepared, len(rays.pixels), timing, frame=first) as stage:
        run = _Run(report, stage, watch, len(frames) * (1 if lamp is None else 2))
        for frame in frames:
            run.update(frame)
            cast = run.cast(f"frame {frame}", rays, partial(stage.look, view))
            pose = stage.pose
            seen = pixels.seen_by(camera, pose.vertices, pose.prepared, rays, cast.hits)
            lit = None
            if lamp is not None:
                below = pixels.shadow_rays_of(seen, lamp, config.fmt, rays)
                cast = run.cast(f"frame {frame}, shadows", below, partial(stage.cast, below))
                lit = pixels.lit_by(seen, below, cast.hits)
            run.compare(frame)
            watch.paint(seen, lit)
    run.sum()
    return report


def _only_pose(prepared: Prepared, frames: range) -> int:
    """The first of frames that a machine without update processor can show: all are alike."""
    bits = prepared.coordinates(frames[0])
    for frame in frames[1:]:
        if (prepared.coordinates(frame) != bits).any():
            prepared.check_updates(frame)
    return frames[0]


class _Run:
    """A run under way: its report and what is summed up at its end."""

    def __init__(self, report: RenderReport, stage: Stage, watch: Watch, passes: int):
        self.report, self.stage, self.watch = report, stage, watch
        self.frames_per_pass = len(report.frames) / passes
        self.passes: list[Pass] = []
        self.update_counters: Counter = Counter()
        self.infinite = 0  # updates with infinite vertices

    def update(self, frame: int):
        """Bring the scene to a frame."""
        self.watch.step(f"frame {frame}: updating")
        begin = perf_counter()
        counters = self.stage.show(frame)
        self.report.wall_seconds += perf_counter() - begin
        if counters:
            self.report.updates += 1
            self.report.words_sent += self.stage.sent
            self.update_counters.update(counters["update"])
            self.infinite += counters["overflows"]["update"]

    def cast(self, name: str, rays: Rays, run: Callable[..., Cast]) -> Cast:
        """Cast rays by one of the stage's ways, and check what they come to."""
        done = self.frames_per_pass * len(self.passes)
        share = self.frames_per_pass / max(len(rays.t_min), 1)
        self.watch.step(f"{name}: simulating")
        begin = perf_counter()
        cast = run(tick=lambda ended: self.watch.tick(done + share * ended))
        self.report.wall_seconds += perf_counter() - begin
        self.watch.step(f"{name}: checking")
        self.passes.append(check_pass(name, self.stage, rays, cast))
        self.watch.record(self.stage, rays, cast)
        self.watch.tick(done + self.frames_per_pass)
        return cast

    def compare(self, frame: int):
        """Hold the words of the scene to what they should be."""
        report, image = self.report, self.stage.pose.image
        found = self.stage.machine.read(0, image.size)
        count, lines = describe_all(image, frame, self.stage.pose.words, found)
        report.model_mismatches += count
        report.mismatches_shown += lines

    def sum(self):
        """Figures of all passes."""
        report, passes = self.report, self.passes
        camera = passes[:: len(passes) // len(report.frames)]
        counters = total([p.counters for p in passes])
        report.rays = sum(p.rays for p in passes)
        report.shadow_rays = report.rays - sum(p.rays for p in camera)
        report.cycles = sum(p.cycles for p in passes)
        report.cycles_per_frame = _per_frame([p.cycles for p in passes], len(report.frames))
        report.cycles_per_ray = report.cycles / report.rays
        report.steps_per_packet = counters["steps"] / counters["packets"]
        report.triangle_tests_per_ray = counters["ray_tests"] / report.rays
        report.hit_fraction = sum(p.hits for p in camera) / sum(p.rays for p in camera)
        report.model_mismatches += sum(p.mismatches for p in passes)
        shown = [line for p in passes for line in p.shown]
        report.mismatches_shown = [*shown, *report.mismatches_shown][:SHOWN]
        infinite = {"update": self.infinite} if self.stage.pose.prepared.config.update else {}
        report.overflows = infinite | total([p.overflows for p in passes])
        report.oracle = oracle_figures([p.oracle for p in passes])
        report.cache = {kind: total([p.cache[kind] for p in passes]) for kind in passes[0].cache}
        report.update_cycles = self.update_counters.total()
        report.update_share = report.update_cycles / (report.update_cycles + report.cycles)
        waits = {k: v for k, v in self.update_counters.items() if k != "instructions"}
        report.stall_cycles = {"update": waits, "rays": total([p.waits for p in passes])}
        report.model_rays_per_second = report.rays / sum(p.model_seconds for p in passes)
        cycles = report.cycles + report.update_cycles
        report.simulated_cycles_per_second = cycles / report.wall_seconds


def _per_frame(values: list[int], frames: int) -> list[int]:
    """Sums of as many values a frame."""
    return np.reshape(values, (frames, -1)).sum(axis=1).tolist()
