"""Options that several commands of `bkd-host` share, and what they mean."""

from contextlib import ExitStack
from dataclasses import replace

from hdl.isa import NODE_BITS
from host.cli.meter import Meter
from host.fit import check_soon
from host.link.port import BAUD, default_port
from host.registers import check_config
from host.session import Board
from sim.command import Parser, format_of
from sim.configuration import read_config
from sim.options import compiler_of, divide_argument, scene_arguments, scene_of
from sim.prepare import Prepared
from sim.scene.scene import Scene


def common(parser: Parser):
    """The options of all commands: the port."""
    add = parser.add_argument
    add("--port", metavar="URL", help="of the board; $BKDTREE_PORT, or the only one")
    add("--baud", metavar="N", type=int, help=f"of the port; {BAUD}")


def board_scene_arguments(parser: Parser):
    """The scene, how it is compiled, and what the board is to be."""
    scene_arguments(parser)
    divide_argument(parser)
    board_arguments(parser)


def board_arguments(parser: Parser):
    """What the board is to be."""
    add = parser.add_argument
    text = "refuse a board of another configuration: a name, or a file"
    add("-c", "--config", metavar="CONFIG", help=text)
    add("--format", metavar="E,M", help="refuse a board of other floats")


def board_of(options) -> Board:
    """The board that options name."""
    fmt = getattr(options, "format", None)
    wanted = format_of(fmt) if fmt else None
    text = getattr(options, "config", None)
    config = read_config(text) if text else None
    port = getattr(options, "port", None) or default_port()
    with ExitStack() as closed:
        board = closed.enter_context(Board.open(port, getattr(options, "baud", BAUD), wanted))
        if config:
            check_config(board.config, config, board.channel.name)
        closed.pop_all()
    return board


def prepare_for(board: Board, scene: Scene, options, meter: Meter) -> Prepared:
    """A scene, compiled for a board; what is far too large is refused at once."""
    if not options.divide:  # objects may share their geometry
        check_soon(scene, board.config, board.words)
    # What fits the memory is for the board to say, in its own numbers.
    config = replace(board.config, address_bits=NODE_BITS)
    return compiler_of(options)(scene, config, builder=options.builder, step=meter.step)


def load(options, meter: Meter) -> Scene:
    """The scene that options name."""
    meter.step("reading the scene")
    return scene_of(options)
