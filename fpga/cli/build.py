"""`bkd-fpga build`."""

import sys
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.table import Table

from fpga.boards import BOARDS
from fpga.boards.board import Board
from fpga.boards.pins import read_pins
from fpga.build import Result, build
from fpga.project import BITSTREAM, project
from fpga.tools import BuildError
from sim.command import Parser
from sim.console import print_tables, table
from sim.errors import InputError
from sim.files import check_writable, write_json

EXAMPLE = "build ulx3s"


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    add("board", metavar="BOARD", choices=BOARDS, help="%(choices)s")
    add("--pins", metavar="FILE", type=Path, help="TOML: pins, for a board that needs it")
    add("--seed", metavar="N", type=int, default=1, help="of nextpnr's placer; %(default)s")
    add("-o", "--out", metavar="DIR", type=Path, help="folder of the project; build/BOARD")
    add("--dry-run", action="store_true", help="write the project, print what would build it")
    add("--json", metavar="FILE", type=Path, help="write the figures to FILE")


def run(options) -> int:
    """Build a machine for a board: its memory, and the serial line to a host."""
    check_writable(options.json)
    board: Board = BOARDS[options.board]
    folder: Path = options.out or Path("build", board.name)
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is no folder; name another by -o")
    if options.pins and not board.needs:
        raise InputError(f"--pins {options.pins}: the pins of {board.name} are known; leave it out")
    pins = read_pins(options.pins, board.needs) if options.pins else {}
    missing = [name for name in board.needs if name not in pins]
    with Console(stderr=True).status("") as status:
        status.update("writing the project")
        made = project(board, pins, options.seed)
        if options.dry_run or missing:
            made.write(folder)
        if options.dry_run:
            print(made.shell_command(folder))
            return 0
        if missing:
            raise BuildError(
                f"the pins of {board.name} are not known: write {', '.join(missing)} to a file, as "
                f'in clk = "AB12", and give it by --pins; without them the project is in {folder}'
            )
        result = build(board, made, folder, status.update)
    print_tables(_table(board, result, folder))
    write_json(options.json, {"board": board.name, **asdict(result)})
    if result.closes:
        return 0
    print(
        f"bkd-fpga: {board.name}: the core's clock reaches {result.fmax_mhz:.1f} MHz of the "
        f"{result.clock_mhz:g} it is to have; try another --seed",
        file=sys.stderr,
    )
    return 1


def _table(board: Board, result: Result, folder: Path) -> Table:
    """What was built."""
    fmax = f"{result.fmax_mhz:.1f} MHz" if result.fmax_mhz else f"see the reports in {folder}"
    rows = [
        ("bitstream", f"{folder / BITSTREAM}"),
        ("clock of the core", f"{result.clock_mhz:g} MHz"),
        ("Fmax", fmax),
        *(
            (name, f"{used:,} of {there:,}: {used / there:.0%}")
            for name, (used, there) in result.resources.items()
        ),
        ("built in", f"{result.seconds / 60:.1f} minutes"),
    ]
    return table(f"{board.name}, built by {board.tools}", rows)
