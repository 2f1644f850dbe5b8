"""`bkd-host render`."""

from host.cli import play
from host.cli.parser import board_scene_arguments
from sim.command import Parser

EXAMPLE = "render walker:2000 --frame 8 --show"


def arguments(parser: Parser):
    """Options of the command."""
    board_scene_arguments(parser)
    parser.add_argument("--frame", metavar="K", help="that a third of the way")
    play.picture_arguments(parser)


def run(options) -> int:
    """Render a frame of a scene on a board."""
    return play.run_frame(options)
