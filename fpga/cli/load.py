"""`bkd-fpga load`."""

import subprocess
from pathlib import Path

from fpga.boards import BOARDS
from fpga.boards.board import Board
from fpga.project import BITSTREAM
from fpga.tools import BuildError, loader
from sim.command import Parser
from sim.errors import InputError

EXAMPLE = "load ulx3s"


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    add("board", metavar="BOARD", choices=BOARDS, help="%(choices)s")
    text = "bitstream; that which bkd-fpga build writes for the board"
    add("file", metavar="FILE", type=Path, nargs="?", help=text)


def run(options) -> int:
    """Load a bitstream into a board, by openFPGALoader."""
    board: Board = BOARDS[options.board]
    if not board.loader:
        raise InputError(f"openFPGALoader does not know {board.name}: load it by {board.tools}")
    file: Path = options.file or Path("build", board.name, BITSTREAM)
    if not file.is_file():
        raise InputError(f"{file}: no such bitstream; run bkd-fpga build {board.name}")
    command = [*loader(), *board.loader, str(file)]
    done = subprocess.run(command, stderr=subprocess.PIPE, text=True)
    if done.returncode:
        said = done.stderr.strip().splitlines() or ["no message"]
        raise BuildError(f"openFPGALoader failed: {said[-1]}; is {board.name} connected?")
    return 0
