"""The command `bkd-sim`: build, simulate, check, report."""

import json
import os
import re
import sys
import tempfile
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from sim.compiler.disassemble import disassemble
from sim.cosim.machine import Timing
from sim.cosim.verilate import SimulationError
from sim.errors import InputError
from sim.prepare import Prepared, prepare
from sim.report.info import info_tables, scene_info
from sim.report.tables import update_tables
from sim.report.update import measure_update
from sim.scene.load import load_scene
from sim.tree.build import BUILDERS

SCENE_HELP = (
    "walker, waves, room or burst, with a size as in walker:80k; an .npz with faces and vertices; "
    "glTF; any mesh file; a folder or pattern of numbered meshes"
)
app = typer.Typer(
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    help="Simulate, check and measure a B-KD tree machine.\n\n"
    "Example: bkd-sim update walker --frames 0:4",
)

SceneArgument = Annotated[str, typer.Argument(metavar="SCENE", help=SCENE_HELP)]
FramesOption = Annotated[str | None, typer.Option(metavar="A:B", help="frames A to B - 1; or one")]
BuilderOption = Annotated[str, typer.Option(metavar="NAME", help=", ".join(BUILDERS))]
FormatOption = Annotated[
    str, typer.Option("--format", metavar="E,M", help="exponent and mantissa bits of floats")
]
LatencyOption = Annotated[int, typer.Option(help="cycles that memory takes, 1 to 256")]
FpsOption = Annotated[float | None, typer.Option(help="glTF: frames a second; 24 if not given")]
AnimationOption = Annotated[str | None, typer.Option(help="glTF: name or number; else the first")]
PeriodOption = Annotated[int | None, typer.Option(help="walker, ...: frames of a period, else 24")]
JsonOption = Annotated[Path | None, typer.Option("--json", metavar="FILE", help="figures as JSON")]


@app.command(epilog="Example: bkd-sim update walker:80k --frames 0:4 --json walker.json")
def update(
    scene: SceneArgument,
    frames: FramesOption = None,
    builder: BuilderOption = "sah",
    latency: LatencyOption = 32,
    stalls: Annotated[float, typer.Option(help="share of cycles in which memory stalls")] = 0.0,
    seed: Annotated[int, typer.Option(help="of the stalls")] = 1,
    fmt: FormatOption = "7,16",
    fps: FpsOption = None,
    animation: AnimationOption = None,
    period: PeriodOption = None,
    json_file: JsonOption = None,
    waves: Annotated[Path | None, typer.Option(metavar="FILE.fst", help="all waves")] = None,
):
    """Update the tree for every frame in the Verilog, and check every bit against the model."""
    timing = _checked(Timing, latency=latency, stalls=stalls, seed=seed)
    _check_writable(json_file, waves)
    with _progress() as progress:
        task = progress.add_task("", total=None)

        def step(text):
            progress.update(task, description=text)

        prepared = _prepare(scene, frames, builder, fmt, latency, fps, animation, period, step)
        progress.update(task, total=len(prepared.frames))
        report = measure_update(
            prepared,
            timing,
            builder=builder,
            waves=waves,
            step=step,
            done=lambda _: progress.advance(task),
        )
    for shown in update_tables(report):
        _print(shown)
    _write_json(json_file, report.as_dict())
    if report.mismatches:
        for line in report.mismatches_shown:
            print(line, file=sys.stderr)
        raise typer.Exit(1)


@app.command(epilog="Example: bkd-sim info walker")
def info(
    scene: SceneArgument,
    frames: FramesOption = None,
    builder: BuilderOption = "sah",
    fmt: FormatOption = "7,16",
    latency: LatencyOption = 32,
    fps: FpsOption = None,
    animation: AnimationOption = None,
    period: PeriodOption = None,
    json_file: JsonOption = None,
):
    """Describe a scene, its tree, its program and where they lie in memory."""
    with _progress() as progress:
        task = progress.add_task("", total=None)
        prepared = _prepare(
            scene, frames, builder, fmt, latency, fps, animation, period,
            lambda text: progress.update(task, description=text),
        )  # fmt: skip
        figures = scene_info(prepared)
    for shown in info_tables(figures):
        _print(shown)
    _write_json(json_file, figures)


@app.command(epilog="Example: bkd-sim disasm walker | head")
def disasm(
    scene: SceneArgument,
    frames: FramesOption = None,
    builder: BuilderOption = "sah",
    fmt: FormatOption = "7,16",
    latency: LatencyOption = 32,
    fps: FpsOption = None,
    animation: AnimationOption = None,
    period: PeriodOption = None,
):
    """Print the program of a scene, an instruction a line."""
    prepared = _prepare(scene, frames, builder, fmt, latency, fps, animation, period)
    for index, line in enumerate(disassemble(prepared.image.instructions)):
        print(f"{index:8}  {line}")


def _prepare(
    scene, frames, builder, fmt, latency, fps, animation, period, step=lambda _: None
) -> Prepared:
    if builder not in BUILDERS:
        raise InputError(f"no builder {builder!r}: take one of {', '.join(BUILDERS)}")
    config = _config(fmt, latency)
    step("reading the scene")
    loaded = load_scene(scene, fps=fps, animation=animation, frames=period)
    chosen = _frames(frames, loaded.frames)
    return prepare(loaded, config, frames=chosen, builder=builder, step=step)


def _config(fmt: str, latency: int) -> Config:
    """The full machine, with another format and for another memory."""
    match = re.fullmatch(r"(\d+),(\d+)", fmt)
    if not match:
        raise InputError(f"--format {fmt}: give exponent and mantissa bits, as in 7,16")
    chosen = _checked(FloatFormat, exp_bits=int(match[1]), man_bits=int(match[2]))
    return _checked(lambda **new: replace(FULL, **new), fmt=chosen, latency=latency)


def _frames(text: str | None, count: int) -> range | None:
    """Frames of A:B, of one number, or None for all."""
    if text is None:
        return None
    match = re.fullmatch(r"(\d*)(:?)(\d*)", text)
    if not match or text == "":
        raise InputError(f"--frames {text}: give A:B for frames A to B - 1, or one frame")
    first = int(match[1] or 0)
    last = int(match[3] or count) if match[2] else first + 1
    chosen = range(first, last)
    if not chosen or chosen[-1] >= count:
        raise InputError(f"--frames {text}: the scene has frames 0 to {count - 1}")
    return chosen


def _checked(make, **values):
    """What `make` makes of options; what it refuses is bad input."""
    try:
        return make(**values)
    except ValueError as error:
        raise InputError(str(error)) from error


def _progress() -> Progress:
    """Progress on standard error; none where that is no terminal."""
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


def _print(shown):
    """Print a table, no wider than 80 columns even into a pipe."""
    console = Console(highlight=False)
    console.print(shown, width=min(console.width, 80) if console.is_terminal else 80)


def _check_writable(*files: Path | None):
    """Refuse files that cannot be written, before the work and not after it."""
    for file in files:
        if file and (file.is_dir() or not os.access(file.absolute().parent, os.W_OK)):
            raise InputError(f"{file}: cannot be written; name a file in a folder that exists")


@contextmanager
def _replacing(file: Path):
    """A temporary name beside `file`, that takes its place when all went well."""
    with tempfile.TemporaryDirectory(dir=file.absolute().parent) as folder:
        temporary = Path(folder) / file.name
        yield temporary
        temporary.replace(file)


def _write_json(file: Path | None, figures: dict):
    if file:
        _check_writable(file)
        with _replacing(file) as temporary:
            temporary.write_text(json.dumps(figures, indent=1) + "\n")


def main():
    """Run the command; errors that a user can mend are one line, and exit code 2."""
    try:
        app()
    except (InputError, SimulationError) as error:
        print(f"bkd-sim: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
