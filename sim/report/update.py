"""Every frame of a scene through the update processor, checked word for word and measured."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from time import perf_counter

import numpy as np

from hdl.isa import Opcode
from hdl.records import instructions_per_word
from sim.compiler.image import Image
from sim.cosim.machine import Machine, Timing
from sim.errors import UnfitError
from sim.model.update import execute
from sim.pose import pose_of
from sim.prepare import Prepared
from sim.report.mismatch import SHOWN, describe_all
from sim.tree.build import build
from sim.tree.cost import pose_cost


@dataclass
class UpdateReport:
    """Figures of a run; a list has one entry a frame. Cycles are of the Verilog.

    `overflows` counts the frames in which a vertex was infinite in the format. `words_sent` are the
    memory words that the host wrote: of the first frame all.
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
    words_sent: list[int] = field(default_factory=list)
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
    if not prepared.config.update:
        raise UnfitError(
            f"{prepared.scene.name}: the machine has no update processor, and nothing to measure: "
            f"use a configuration with update true, or bkd-sim render for its pictures"
        )
    image, triangles = prepared.image, len(prepared.scene.faces)
    instructions = len(image.instructions)
    loads = int((image.instructions & 3 == Opcode.LOAD.value).sum())
    program = -(-instructions // instructions_per_word(prepared.config.fmt))
    report = UpdateReport(
        scene=prepared.scene.name,
        triangles=triangles,
        vertices=len(image.vertices),
        frames=list(prepared.frames),
        format=str(prepared.config.fmt),
        latency=timing.latency,
        stalls=timing.stalls,
        instructions_per_triangle=instructions / triangles,
        loads_per_triangle=loads / triangles,
        memory_words_per_triangle=(program + loads + int(image.updated.sum())) / triangles,
        box_registers=image.order.boxes,
        build_seconds=prepared.build_seconds,
        compile_seconds=prepared.compile_seconds,
    )
    step("building the simulator")
    with Machine(prepared.config, image.size, timing, waves) as machine:
        step("simulating")
        held = None
        bounds = np.zeros((image.nodes, 4), np.int64)
        seconds = 0.0
        for frame in prepared.frames:
            pose = pose_of(prepared, frame)
            prepared, image = pose.prepared, pose.image
            written = pose.before_update(bounds)
            report.words_sent.append(machine.change(held, written))
            begin = perf_counter()
            _count(report, _updated(machine, image))
            seconds += perf_counter() - begin
            report.overflows += machine.overflow

            stale = image.bounds_of(written[image.nodes_at : image.still_at])
            ran = execute(prepared.config, image.instructions, pose.vertex_records, stale)
            report.mismatches += int((ran != pose.bounds).any(axis=1).sum())
            held, bounds = pose.words, pose.bounds
            count, lines = describe_all(image, frame, held, machine.read(0, image.size))
            report.mismatches += count
            report.mismatches_shown = [*report.mismatches_shown, *lines][:SHOWN]

            report.sah_ratio.append(_sah_ratio(prepared, frame, builder))
            done(frame)
    report.cycles_per_triangle = report.cycles / (triangles * len(report.frames))
    report.simulated_cycles_per_second = report.cycles / seconds
    return report


def _updated(machine: Machine, image: Image) -> dict[str, int]:
    """The cycles of an update, by kind; none where nothing can move."""
    if not len(image.instructions):
        return {}
    return machine.update(0, len(image.instructions), image.vertices_at, image.nodes_at)


def _count(report: UpdateReport, counters: dict[str, int]):
    cycles = sum(counters.values())
    report.cycles += cycles
    report.cycles_per_frame.append(cycles)
    for cause, count in counters.items():
        if cause != "instructions":
            report.stall_cycles[cause] = report.stall_cycles.get(cause, 0) + count


def _sah_ratio(prepared: Prepared, frame: int, builder: str) -> float:
    """Of the tree that is updated: in a divided scene that of the world."""
    points, faces = prepared.points(frame), prepared.tree_faces
    rebuilt = pose_cost(build(points, faces, builder), points, faces)
    return pose_cost(prepared.tree, points, faces) / rebuilt
