"""Every frame of a scene through the update processor, checked word for word and measured."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter

from sim.cosim.machine import Machine, Timing
from sim.model.refit import refit
from sim.model.update import execute
from sim.prepare import Prepared
from sim.report.mismatch import SHOWN, describe_all
from sim.tree.build import build
from sim.tree.cost import pose_cost


@dataclass
class UpdateReport:
    """Figures of a run; a list has one entry a frame. Cycles are of the Verilog.

    `overflows` counts the frames in which a vertex was infinite in the format.
    """

    scene: str
    triangles: int
    vertices: int
    frames: list[int]
    format: str
    latency: int
    stalls: float
    instructions_per_triangle: float
    loads_per_triangle: float
    memory_words_per_triangle: float
    box_registers: int
    build_seconds: float
    compile_seconds: float
    overflows: int = 0
    mismatches: int = 0
    mismatches_shown: list[str] = field(default_factory=list)
    cycles: int = 0
    cycles_per_frame: list[int] = field(default_factory=list)
    cycles_per_triangle: float = 0.0
    stall_cycles: dict[str, int] = field(default_factory=dict)
    sah_ratio: list[float] = field(default_factory=list)
    simulated_cycles_per_second: float = 0.0

    def as_dict(self) -> dict:
        return asdict(self)


def measure_update(
    prepared: Prepared,
    timing: Timing,
    *,
    builder: str = "sah",
    waves: Path | None = None,
    step: Callable[[str], None] = lambda _: None,
    done: Callable[[int], None] = lambda _: None,
) -> UpdateReport:
    """Update every frame in the Verilog; compare all of its memory with the model's.

    The model is both the interpreter and the refit that knows only the tree: a word that is not
    what the refit gives counts, and so does a bound in which the two differ.

    Parameters
    ----------
    prepared : Prepared
    timing : Timing
        Of the memory.
    builder : str
        Of the trees that `sah_ratio` compares with: the cost of the tree in each pose over the
        cost of one built for it.
    waves : Path, optional
        FST file.
    step, done : callables
        Are told what begins, and each frame that is done.

    Raises
    ------
    SimulationError
        The simulator fails.
    InputError
        The format is too narrow for a frame, or the machine updates no tree.
    """
    prepared.check_updates(prepared.frames[-1])
    image, faces = prepared.image, prepared.scene.faces
    triangles, loads = len(faces), int((image.instructions & 3 == 0).sum())
    report = UpdateReport(
        scene=prepared.scene.name,
        triangles=triangles,
        vertices=len(image.vertices),
        frames=list(prepared.frames),
        format=str(prepared.config.fmt),
        latency=timing.latency,
        stalls=timing.stalls,
        instructions_per_triangle=len(image.instructions) / triangles,
        loads_per_triangle=loads / triangles,
        memory_words_per_triangle=(image.vertices_at + loads + image.nodes) / triangles,
        box_registers=image.order.boxes,
        build_seconds=prepared.build_seconds,
        compile_seconds=prepared.compile_seconds,
    )
    step("building the simulator")
    with Machine(prepared.config, image.size, timing, waves) as machine:
        step("simulating")
        expected = image.constant_words()
        machine.write(0, expected)
        seconds = 0.0
        for frame in prepared.frames:
            bits = prepared.coordinates(frame)
            vertices = image.vertex_words(bits)
            machine.write(image.vertices_at, vertices)
            begin = perf_counter()
            counters = machine.update(0, len(image.instructions), image.vertices_at, image.nodes_at)
            seconds += perf_counter() - begin
            _count(report, counters)
            report.overflows += machine.overflow

            bounds = refit(prepared.config.fmt, image.order, bits[prepared.leaf_vertices])
            stale = image.bounds_of(expected[image.nodes_at :])
            ran = execute(prepared.config, image.instructions, bits[image.vertices], stale)
            report.mismatches += int((ran != bounds).any(axis=1).sum())
            expected[image.vertices_at : image.triangles_at] = vertices
            expected[image.nodes_at :] = image.node_words(bounds)
            count, lines = describe_all(image, frame, expected, machine.read(0, image.size))
            report.mismatches += count
            report.mismatches_shown = [*report.mismatches_shown, *lines][:SHOWN]

            report.sah_ratio.append(_sah_ratio(prepared, frame, builder))
            done(frame)
    report.cycles_per_triangle = report.cycles / (triangles * len(report.frames))
    report.simulated_cycles_per_second = report.cycles / seconds
    return report


def _count(report: UpdateReport, counters: dict[str, int]):
    cycles = sum(counters.values())
    report.cycles += cycles
    report.cycles_per_frame.append(cycles)
    for cause, count in counters.items():
        if cause != "instructions":
            report.stall_cycles[cause] = report.stall_cycles.get(cause, 0) + count


def _sah_ratio(prepared: Prepared, frame: int, builder: str) -> float:
    vertices, faces = prepared.scene.pose(frame), prepared.scene.faces
    rebuilt = pose_cost(build(vertices, faces, builder), vertices, faces)
    return pose_cost(prepared.tree, vertices, faces) / rebuilt
