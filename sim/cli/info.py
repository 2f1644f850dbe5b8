"""`bkd-sim info`."""

from sim.cli.parser import config_of, machine_arguments
from sim.command import Parser
from sim.console import conclude, progress
from sim.files import check_writable
from sim.options import frames_of, json_argument, scene_arguments, scene_of
from sim.prepare import prepare
from sim.report.info import info_tables, scene_info

EXAMPLE = "info Fox.glb --animation Run"


def arguments(parser: Parser):
    """Options of the command."""
    scene_arguments(parser)
    machine_arguments(parser)
    parser.add_argument("--frames", metavar="A:B", help="frames A to B - 1, or one frame; all")
    json_argument(parser)


def run(options) -> int:
    """Describe a scene, its tree, its program and where they lie in memory."""
    check_writable(options.json)
    config = config_of(options)
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
    conclude(info_tables(figures), options.json, figures, ())
    return 0
