"""`bkd-host identify`."""

from hdl.config import Config
from host import registers
from host.cli.parser import board_arguments, board_of
from host.session import Board
from sim.command import Parser
from sim.console import print_tables, table
from sim.files import check_writable, write_json
from sim.options import json_argument

EXAMPLE = "--port /dev/ttyUSB0 identify"


def arguments(parser: Parser):
    """Options of the command."""
    board_arguments(parser)
    json_argument(parser)


def run(options) -> int:
    """Say what a board is: its format, memory, units and clock."""
    check_writable(options.json)
    with board_of(options) as board:
        status = board.status()
        print_tables(table(f"The board on {board.channel.name}", _rows(board, status)))
    figures = {"port": board.channel.name, **board.values}
    write_json(options.json, {name.lower(): value for name, value in figures.items()})
    return 0


def _units(config: Config) -> list[tuple[str, str]]:
    """What it has, and what not."""
    givers = {"a camera": config.camera, "memory": config.source}
    registers = f"{config.vertex_registers}, {config.box_registers}"
    return [
        ("vertex registers, box registers", registers)
        if config.update
        else ("update processor", "none: trees stay as they are uploaded"),
        ("rays come from", " and ".join(name for name, there in givers.items() if there)),
        ("triangles that have an index", f"{config.most_triangles:,}"),
    ]


def _rows(board: Board, status: registers.Status) -> list[tuple[str, str]]:
    config, values = board.config, board.values
    memory = f"{board.words:,} words of {values['WORD_BITS']} bits"
    caches = f"{config.cache_words:,} words each" if config.cache_words else "none: banks on chip"
    clock = f"{board.clock_hz / 1e6:g} MHz" if board.clock_hz else "it does not say"
    bits = f"{config.fmt.exp_bits} exponent, {config.fmt.man_bits} mantissa bits"
    return [
        ("floats", f"{config.fmt}: {bits}"),
        ("memory", memory if values["MEMORY_WORDS"] else f"at most {memory}"),
        ("clock", clock),
        *_units(config),
        ("packets of rays in flight", f"{config.packets}"),
        ("levels that a tree can have", f"{config.stack_depth}"),
        ("caches of nodes and of geometry", caches),
        ("cycles of a memory read that are hidden", f"{config.latency}"),
        ("version of the registers", f"{values['VERSION']}"),
        ("now", "a run is under way" if status.busy else "idle"),
        ("the last run", registers.ENDINGS[status.outcome] if status.done else "none"),
    ]
