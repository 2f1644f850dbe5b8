"""`bkd-host reset`."""

from host.cli.parser import board_of
from sim.command import Parser

EXAMPLE = "reset"


def arguments(parser: Parser):
    """Options of the command: none of its own."""


def run(options) -> int:
    """Stop the run that is under way on a board, and begin a new session."""
    with board_of(options) as board:
        stopped = board.reset()
    print("The run under way was stopped." if stopped else "No run was under way.")
    return 0
