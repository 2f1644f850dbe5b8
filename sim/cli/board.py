"""`bkd-sim board`."""

import re
import signal
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.live import Live

from sim.command import Parser, checked
from sim.configuration import config_argument, read_config
from sim.console import progress
from sim.cosim.board import BAUD, CLOCK_HZ, SimulatedBoard
from sim.cosim.pump import Pump
from sim.cosim.tcp import TcpPort
from sim.cosim.terminal import Terminal
from sim.errors import InputError
from sim.files import check_writable

EXAMPLE = "board -c ulx3s --direct"
REFRESH = 0.2
"""Seconds between two states of the status line."""


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    config_argument(parser, default="ulx3s")
    port = parser.add_mutually_exclusive_group()
    port.add_argument("--pty", action="store_true", help="a pseudo-terminal; the default")
    port.add_argument("--tcp", metavar="[HOST:]PORT", help="a TCP port; 0 for one that is free")
    add("--direct", action="store_true", help="past the UART, at a byte a cycle or two: far faster")
    add("--words", metavar="N", type=int, help="of memory; all with an address, up to 1048576")
    add("--baud", metavar="N", type=float, help=f"of the serial line; {BAUD:.0f}")
    add("--clock", metavar="MHZ", type=float, default=CLOCK_HZ / 1e6, help="of the board; 50")
    add("--waves", metavar="FILE.fst", type=Path, help="write all waves to FILE.fst")


def run(options) -> int:
    """Simulate a board behind a serial port, for bkd-host and others, until Ctrl-C."""
    if options.waves and options.waves.suffix != ".fst":
        raise InputError(
            f"{options.waves}: waves are written as FST; name a file that ends in .fst"
        )
    if options.direct and options.baud:
        raise InputError(f"--baud {options.baud:g}: with --direct there is no UART; leave it out")
    check_writable(options.waves)
    with (
        TcpPort(*_address(options.tcp)) if options.tcp else Terminal() as port,
        _simulated(options) as board,
        _stopped() as stop,
    ):
        print(port.path, flush=True)
        if options.direct:
            print("bkd-sim: bytes go past the UART, one in a cycle or two", file=sys.stderr)
        print(f"bkd-sim: try bkd-host --port {port.path} identify", file=sys.stderr)
        pump = Pump(board, port)
        with _status(pump) as tick:
            pump.run(stop, tick)
        print(f"bkd-sim: {_figures(pump)}", file=sys.stderr)
    return 0


def _address(text: str) -> tuple[str, int]:
    match = re.fullmatch(r"(?:(.+):)?(\d+)", text)
    if not match or int(match[2]) >= 1 << 16:
        raise InputError(f"--tcp {text}: give a port, or host and port, as in 127.0.0.1:4000")
    return match[1] or "127.0.0.1", int(match[2])


def _simulated(options) -> SimulatedBoard:
    if not options.clock > 0:
        raise InputError(f"--clock {options.clock:g}: give MHz above 0")
    with progress() as bar:
        bar.add_task("building the simulator", total=None)
        return checked(
            SimulatedBoard,
            config=read_config(options.config),
            words=options.words,
            clock_hz=options.clock * 1e6,
            baud=options.baud or BAUD,
            direct=options.direct,
            waves=options.waves,
        )


@contextmanager
def _stopped() -> Iterator[socket.socket]:
    """A socket that can be read from Ctrl-C or SIGTERM on, in place of what else they do."""
    ours, theirs = socket.socketpair()
    theirs.setblocking(False)
    before = {
        number: signal.signal(number, lambda *_: None) for number in (signal.SIGINT, signal.SIGTERM)
    }
    signal.set_wakeup_fd(theirs.fileno())
    try:
        yield ours
    finally:
        signal.set_wakeup_fd(-1)
        for number, handler in before.items():
            signal.signal(number, handler)
        ours.close()
        theirs.close()


@contextmanager
def _status(pump: Pump):
    """Called after each piece of work: keeps a status line, where standard error is a terminal."""
    console = Console(stderr=True, highlight=False)
    if not console.is_terminal:
        yield lambda: None
        return
    shown = 0.0
    with Live(console=console, auto_refresh=False, transient=True) as live:

        def tick():
            nonlocal shown
            if pump.board.idle or time.monotonic() > shown + REFRESH:
                shown = time.monotonic()
                live.update(_figures(pump), refresh=True)

        yield tick


def _figures(pump: Pump) -> str:
    board = pump.board
    return (
        f"{board.cycles:,} cycles, {1e3 * board.cycles / board.clock_hz:,.3f} ms simulated, "
        f"{board.cycles / max(board.seconds, 1e-9):,.0f} cycles/s; "
        f"{pump.given:,} bytes in, {pump.received:,} out"
    )
