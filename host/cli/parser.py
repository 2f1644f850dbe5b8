"""Options that several commands of `bkd-host` share, and what they mean."""

from dataclasses import replace

from hdl.isa import NODE_BITS
from host.cli.meter import Meter
from host.fit import check_soon
from host.link.port import BAUD, default_port
from host.session import Board
from sim.command import Parser, format_of
from sim.options import scene_arguments, scene_of
from sim.prepare import Prepared, prepare
from sim.scene.scene import Scene


def common(parser: Parser):
    """The options of all commands: the port."""
    add = parser.add_argument
    add("--port", metavar="URL", help="of the board; $BKDTREE_PORT, or the only one")
    add("--baud", metavar="N", type=int, help=f"of the port; {BAUD}")


def board_scene_arguments(parser: Parser):
    """The scene, and the format that the board is to have."""
    scene_arguments(parser)
    parser.add_argument("--format", metavar="E,M", help="refuse a board of other floats")


def board_of(options) -> Board:
    """The board that options name."""
    fmt = getattr(options, "format", None)
    wanted = format_of(fmt) if fmt else None
    port = getattr(options, "port", None) or default_port()
    return Board.open(port, getattr(options, "baud", BAUD), wanted)


def prepare_for(board: Board, scene: Scene, options, meter: Meter) -> Prepared:
    """A scene, compiled for a board; what is far too large is refused at once."""
    check_soon(scene, board.config, board.words)
    # What fits the memory is for the board to say, in its own numbers.
    config = replace(board.config, address_bits=NODE_BITS)
    return prepare(scene, config, builder=options.builder, step=meter.step)


def load(options, meter: Meter) -> Scene:
    """The scene that options name."""
    meter.step("reading the scene")
    return scene_of(options)
