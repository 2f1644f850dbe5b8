"""`bkd-sim update`."""

from pathlib import Path

from sim.cli.parser import (
    config_of,
    machine_arguments,
    timing_arguments,
    timing_of,
)
from sim.command import Parser
from sim.console import conclude, print_text, progress
from sim.errors import InputError
from sim.files import check_writable
from sim.options import (
    compiler_of,
    divide_argument,
    frames_of,
    json_argument,
    scene_arguments,
    scene_of,
)
from sim.report.tables import update_tables
from sim.report.update import measure_update

EXAMPLE = "update walker:80k --frames 0:4 --json walker.json"


def arguments(parser: Parser):
    """Options of the command."""
    scene_arguments(parser)
    divide_argument(parser)
    machine_arguments(parser)
    timing_arguments(parser)
    add = parser.add_argument
    add("--frames", metavar="A:B", help="frames A to B - 1, or one frame; all")
    add("--waves", metavar="FILE.fst", type=Path, help="write all waves to FILE.fst")
    json_argument(parser)


def run(options) -> int:
    """Update the tree for every frame in the Verilog, and check every bit against the model."""
    if options.waves and options.waves.suffix != ".fst":
        raise InputError(
            f"{options.waves}: waves are written as FST; name a file that ends in .fst"
        )
    check_writable(options.json, options.waves)
    config = config_of(options, latency=options.latency)
    timing = timing_of(options, config)
    with progress() as bar:
        task = bar.add_task("reading the scene", total=None)

        def step(text):
            bar.update(task, description=text)

        scene = scene_of(options)
        frames = options.frames and frames_of(options.frames, scene.frames)
        prepared = compiler_of(options)(
            scene, config, frames=frames, builder=options.builder, step=step
        )
        bar.update(task, total=len(prepared.frames))
        report = measure_update(
            prepared,
            timing,
            builder=options.builder,
            waves=options.waves,
            step=step,
            done=lambda _: bar.advance(task),
        )
    conclude(update_tables(report), options.json, report.as_dict(), report.mismatches_shown)
    if prepared.advice:
        print_text(prepared.advice)
    return 1 if report.mismatches else 0
