"""`bkd-sim analyse`."""

from functools import partial

from hdl.config import FULL
from sim.command import Parser, checked
from sim.console import conclude, print_text, progress
from sim.files import check_writable
from sim.options import frames_of, json_argument, scene_of, source_arguments
from sim.parts.analyse import ERROR, FACTOR, analyse
from sim.parts.costs import costs
from sim.parts.tables import conclusions, figures, parts_table

EXAMPLE = "analyse room:80k --json room.json"


def arguments(parser: Parser):
    """Options of the command."""
    source_arguments(parser)
    add = parser.add_argument
    text = "of an affine map, in half sizes of the scene; 2^-18, half an ulp of F24"
    add("--error", metavar="E", type=float, default=ERROR, help=text)
    text = "of a refitted tree's SAH cost over a new one's; %(default)s"
    add("--factor", metavar="F", type=float, default=FACTOR, help=text)
    add("--frames", metavar="A:B", help="frames A to B - 1, or one frame; all")
    json_argument(parser)


def run(options) -> int:
    """Divide a scene by how its parts move, and say what each costs a frame."""
    check_writable(options.json)
    with progress() as bar:
        task = bar.add_task("reading the scene", total=None)

        def step(text):
            bar.update(task, description=text)

        scene = scene_of(options)
        frames = options.frames and frames_of(options.frames, scene.frames)
        analysis = checked(
            partial(analyse, scene, frames or None, step=step),
            error=options.error,
            factor=options.factor,
        )
        step("counting words and instructions")
        found = costs(scene, analysis, FULL)
    table = parts_table(scene, analysis, found)
    conclude([table], options.json, figures(scene, analysis, found), ())
    for line in conclusions(analysis, found):
        print_text(line)
    return 0
