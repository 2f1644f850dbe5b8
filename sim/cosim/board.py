"""The simulated board, as a Python object that bytes are exchanged with."""

import time
from collections.abc import Sequence
from pathlib import Path

from hdl.board import Board
from hdl.config import Config
from hdl.identification import Surroundings
from hdl.linked import LinkedCore
from sim.cosim import verilate
from sim.cosim.board_bench import LINE_MODEL, BoardBench, DirectBench, DirectBoard, PinsBench
from sim.cosim.chip_memory import CHIP_MEMORY, ChipMemory
from sim.cosim.line import DEPTH, Exchange
from sim.cosim.process import Process

MOST_WORDS = 1 << 20
CLOCK_HZ = 50e6
BAUD = 3e6


class SimulatedChip(Board):
    """A board whose memory the simulator builds quickly."""

    def memory(self) -> ChipMemory:
        """The same in the same cycles."""
        return ChipMemory(self.config, words=self.words)


class SimulatedBoard:
    """The Verilog of a board and of the other end of its line, simulated in a process of its own.

    A context manager: the simulator ends with it. Memory is on the chip, at first zero.

    Parameters
    ----------
    config : Config
    words : int, optional
        Size of the memory; all that the configuration addresses, up to MOST_WORDS.
    clock_hz : float
    baud : float
    direct : bool
        Bytes go past the UART, one in a cycle or two.
    waves : Path, optional
        FST file for the waves of the whole run.
    bench : BoardBench, optional
        Another board than that of the configuration.
    sources : sequence of Path
        Verilog files that it instances.

    Attributes
    ----------
    byte_cycles : float
        Cycles that a byte takes on the line.
    cycles : int
        Simulated so far, but for resets.
    seconds : float
        That this took.
    idle : bool
        Nothing is under way: no cycle need pass until bytes are given.
    room : int
        Bytes that can be given now.
    framing_errors : int
        Bytes of the board that had no stop bit, since its reset.

    Raises
    ------
    ValueError
        There is no such board: its memory, its clock or its rate.
    SimulationError
        The simulator does not build or start.
    """

    def __init__(
        self,
        config: Config,
        *,
        words: int | None = None,
        clock_hz: float = CLOCK_HZ,
        baud: float = BAUD,
        direct: bool = False,
        waves: Path | None = None,
        bench: BoardBench | None = None,
        sources: Sequence[Path] = (),
    ):
        if words is None:
            words = min(1 << config.address_bits, MOST_WORDS)
        made = bench or _bench(config, words, clock_hz, baud, direct)
        self.byte_cycles = made.byte_cycles
        folder = verilate.build(
            made,
            sources=[LINE_MODEL, CHIP_MEMORY, *sources],
            waves=waves is not None,
            identity=None if bench else f"board {config} {words} {clock_hz} {baud} {direct}",
        )
        self._process = Process(folder, "sim.cosim.board_server", waves)
        self.clock_hz = clock_hz
        self.cycles, self.seconds = 0, 0.0
        self.reset()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.close()

    def reset(self):
        """Reset the board, not the words in its memory. Bytes that are under way are lost."""
        self._process.call("reset")
        self.idle = False
        self.room = DEPTH
        self.framing_errors = 0

    def exchange(self, given: bytes, cycles: int) -> Exchange:
        """Give bytes, and let up to `cycles` pass: less if an answer ends before, or all is idle.

        Raises
        ------
        ValueError
            There is no room for the bytes.
        SimulationError
            The simulator has ended.
        """
        if len(given) > self.room:
            raise ValueError(f"the line has room for {self.room} bytes, not for {len(given)}")
        begun = time.perf_counter()
        result = Exchange(*self._process.call("exchange", given, cycles))
        self.seconds += time.perf_counter() - begun
        self.cycles += result.cycles
        self.idle = result.idle
        self.room = DEPTH - result.waiting
        self.framing_errors = result.framing_errors
        return result


def _bench(config: Config, words: int, clock_hz: float, baud: float, direct: bool) -> BoardBench:
    if direct:
        core = LinkedCore(config, Surroundings(words, round(clock_hz)))
        return DirectBench(DirectBoard(core, config, words=words))
    board = SimulatedChip(config, words=words, clock_hz=clock_hz, baud=baud)
    return PinsBench(board, clock_hz / baud)
