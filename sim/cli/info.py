"""`bkd-sim info`."""

from sim.cli.console import check_writable, print_tables, progress, write_json
from sim.cli.parser import Parser, config_of, frames_of, json_argument, scene_arguments, scene_of
from sim.prepare import prepare
from sim.report.info import info_tables, scene_info

EXAMPLE = "info Fox.glb --animation Run"


def arguments(parser: Parser):
    """Options of the command."""
    scene_arguments(parser)
    parser.add_argument("--frames", metavar="A:B", help="frames A to B - 1, or one frame; all")
    json_argument(parser)


def run(options) -> int:
    """Describe a scene, its tree, its program and where they lie in memory."""
    check_writable(options.json)
    config = config_of(options.format)
    with progress() as bar:
        task = bar.add_task("reading the scene", total=None)
        scene = scene_of(options)
        frames = options.frames and frames_of(options.frames, scene.frames)
        prepared = prepare(
            scene,
            config,
            frames=frames,
            builder=options.builder,
            step=lambda text: bar.update(task, description=text),
        )
        figures = scene_info(prepared)
    print_tables(*info_tables(figures))
    write_json(options.json, figures)
    return 0
