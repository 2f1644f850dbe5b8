"""`bkd-host bench`."""

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter

from host.cli.meter import Meter
from host.cli.parser import board_of
from host.session import Board
from sim.command import Parser
from sim.console import print_tables, table
from sim.errors import InputError
from sim.files import check_writable, write_json
from sim.options import json_argument

EXAMPLE = "bench --seconds 2"
PROBE, MOST = 4 << 10, 8 << 20
"""Bytes to find out how fast it is, and at most."""
COMMANDS = 50
"""Status commands that are timed."""


@dataclass(frozen=True)
class Span:
    """How long something took: here, and by the board's own clock, if it says how fast that is."""

    seconds: float
    board_seconds: float | None

    def rate(self, amount: int) -> dict[str, float | None]:
        """Of so much a second."""
        board = amount / self.board_seconds if self.board_seconds else None
        return {"wall": amount / self.seconds, "board": board}


def arguments(parser: Parser):
    """Options of the command."""
    text = "that reads, and writes, take about; %(default)s"
    parser.add_argument("--seconds", metavar="S", type=float, default=1.0, help=text)
    json_argument(parser)


def run(options) -> int:
    """Measure how fast a board is read and written; its memory stays as it is."""
    check_writable(options.json)
    if options.seconds <= 0:
        raise InputError(f"--seconds {options.seconds:g}: give more than 0")
    with Meter() as meter, board_of(options) as board:
        meter.step("timing")
        if board.status().busy:
            raise InputError(
                f"{board.channel.name}: a run is under way; wait for its end, or stop it by "
                f"bkd-host reset"
            )
        word = board.values["WORD_BITS"] // 8
        probe = min(PROBE // word, board.words)
        trial = _timed(board, lambda: board.read(0, probe))
        most = min(MOST, int(options.seconds * trial.rate(probe * word)["wall"] or 0))
        words = min(max(probe, most // word), board.words)
        rows = []
        meter.begin("reading", words * word)
        reads = _timed(board, lambda: rows.append(board.read(0, words, progress=meter.moved)))
        meter.begin("writing", words * word)
        writes = _timed(board, lambda: board.write(0, rows[0], progress=meter.moved))
        meter.step("timing commands")
        status = _timed(board, lambda: [board.status() for _ in range(COMMANDS)])
        retransmissions = board.channel.statistics.retransmissions
    figures = {
        "bytes": words * word,
        "read_bytes_per_second": reads.rate(words * word),
        "write_bytes_per_second": writes.rate(words * word),
        "status_commands_per_second": status.rate(COMMANDS),
        "clock_hz": board.clock_hz,
        "retransmissions": retransmissions,
    }
    print_tables(_table(board, figures))
    write_json(options.json, figures)
    return 0


def _timed(board: Board, work: Callable[[], object]) -> Span:
    before, begin = board.status().cycles, perf_counter()
    work()
    seconds, cycles = perf_counter() - begin, (board.status().cycles - before) % (1 << 32)
    return Span(seconds, cycles / board.clock_hz if board.clock_hz else None)


def _table(board: Board, figures: dict):
    def both(key: str, shown: Callable[[float], str]) -> tuple[str, str]:
        wall, clock = figures[key]["wall"], figures[key]["board"]
        return shown(wall), shown(clock) if clock else "its clock is not known"

    def kilobytes(rate: float) -> str:
        return f"{rate / 1000:,.1f} kB/s"

    def milliseconds(rate: float) -> str:
        return f"{1000 / rate:,.3f} ms"

    rows = [
        ("reads", *both("read_bytes_per_second", kilobytes)),
        ("writes", *both("write_bytes_per_second", kilobytes)),
        ("a status command", *both("status_commands_per_second", milliseconds)),
    ]
    title = (
        f"{board.channel.name}: {figures['bytes']:,} bytes, {figures['retransmissions']} frames "
        f"sent again"
    )
    return table(title, rows, header=("", "wall time", "by the board's clock"))
