"""The command `bkd-sim`: build, simulate, check, report."""

import argparse
import json
import os
import re
import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

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


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message):
        raise InputError(f"{message}; see {self.prog} --help")


def parser() -> argparse.ArgumentParser:
    """All commands and their options."""
    scene = Parser(add_help=False)
    add = scene.add_argument
    add("scene", metavar="SCENE", help=SCENE_HELP)
    add("--frames", metavar="A:B", help="frames A to B - 1, or one frame; all if not given")
    add("--builder", choices=BUILDERS, default="sah", help="of the tree; %(default)s")
    add("--format", metavar="E,M", default="7,16", help="bits of a float; %(default)s")
    add("--latency", metavar="N", type=int, default=32, help="of memory, in cycles; %(default)s")
    add("--fps", metavar="N", type=float, help="glTF: frames a second; 24")
    add("--animation", metavar="NAME", help="glTF: name or number; the first")
    add("--period", metavar="N", type=int, help="walker, ...: frames of a period; 24")

    top = Parser(prog="bkd-sim", description="Simulate, check and measure a B-KD tree machine.")
    top.epilog = "Example: bkd-sim update walker --frames 0:4"
    commands = top.add_subparsers(metavar="COMMAND", required=True, parser_class=Parser)

    def command(run: Callable, example: str):
        text = (run.__doc__ or "").split("\n")[0]
        sub = commands.add_parser(
            run.__name__,
            help=text,
            description=text,
            epilog=f"Example: bkd-sim {example}",
            parents=[scene],
        )
        sub.set_defaults(run=run)
        return sub.add_argument

    add = command(update, "update walker:80k --frames 0:4 --json walker.json")
    add("--stalls", metavar="P", type=float, default=0.0, help="share of cycles memory stalls; 0")
    add("--seed", metavar="N", type=int, default=1, help="of the stalls; %(default)s")
    add("--json", metavar="FILE", type=Path, help="write the figures to FILE")
    add("--waves", metavar="FILE.fst", type=Path, help="write all waves to FILE.fst")
    add = command(info, "info Fox.glb --animation Run")
    add("--json", metavar="FILE", type=Path, help="write the figures to FILE")
    command(disasm, "disasm walker | head")
    return top


def update(options) -> int:
    """Update the tree for every frame in the Verilog, and check every bit against the model."""
    timing = _checked(Timing, latency=options.latency, stalls=options.stalls, seed=options.seed)
    if options.waves and options.waves.suffix != ".fst":
        raise InputError(
            f"{options.waves}: waves are written as FST; name a file that ends in .fst"
        )
    _check_writable(options.json, options.waves)
    with _progress() as progress:
        task = progress.add_task("", total=None)

        def step(text):
            progress.update(task, description=text)

        prepared = _prepare(options, step)
        progress.update(task, total=len(prepared.frames))
        report = measure_update(
            prepared,
            timing,
            builder=options.builder,
            waves=options.waves,
            step=step,
            done=lambda _: progress.advance(task),
        )
    _print(*update_tables(report))
    _write_json(options.json, report.as_dict())
    for line in report.mismatches_shown:
        print(line, file=sys.stderr)
    return 1 if report.mismatches else 0


def info(options) -> int:
    """Describe a scene, its tree, its program and where they lie in memory."""
    _check_writable(options.json)
    with _progress() as progress:
        task = progress.add_task("", total=None)
        prepared = _prepare(options, lambda text: progress.update(task, description=text))
        figures = scene_info(prepared)
    _print(*info_tables(figures))
    _write_json(options.json, figures)
    return 0


def disasm(options) -> int:
    """Print the program of a scene, an instruction a line."""
    prepared = _prepare(options)
    for index, line in enumerate(disassemble(prepared.image.instructions)):
        print(f"{index:8}  {line}")
    return 0


def _prepare(options, step: Callable[[str], None] = lambda _: None) -> Prepared:
    config = _config(options.format, options.latency)
    step("reading the scene")
    loaded = load_scene(
        options.scene, fps=options.fps, animation=options.animation, period=options.period
    )
    chosen = _frames(options.frames, loaded.frames)
    return prepare(loaded, config, frames=chosen, builder=options.builder, step=step)


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


def _print(*tables):
    """Print tables, no wider than 80 columns even into a pipe."""
    console = Console(highlight=False)
    width = min(console.width, 80) if console.is_terminal else 80
    console.print(*tables, sep="", width=width)


def _check_writable(*files: Path | None):
    """Refuse files that cannot be written, before the work and not after it."""
    for file in files:
        if file and (file.is_dir() or not os.access(file.absolute().parent, os.W_OK)):
            raise InputError(f"{file}: cannot be written; name a file in a folder that exists")


def _write_json(file: Path | None, figures: dict):
    """Write figures whole or not at all."""
    if file:
        with tempfile.TemporaryDirectory(dir=file.absolute().parent) as folder:
            temporary = Path(folder) / file.name
            temporary.write_text(json.dumps(figures, indent=1) + "\n")
            temporary.replace(file)


def main():
    """Run the command; errors that a user can mend are one line, and exit code 2."""
    try:
        options = parser().parse_args()
        sys.exit(options.run(options))
    except (InputError, SimulationError) as error:
        print(f"bkd-sim: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
