"""A board and the other end of its serial line, in one Verilog."""

from pathlib import Path
from typing import Protocol

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.linked import LinkedCore
from sim.cosim.chip_memory import ChipMemory
from sim.cosim.line import BULK, DEPTH

LINE_MODEL = Path(__file__).parent / "line_model.v"

FINENESS = 256
"""Parts of a cycle in which the length of a bit is counted."""


class Pins(Protocol):
    """A board with its UART; the line is high while nothing is sent."""

    rx: Signal
    tx: Signal
    busy: Signal

    def elaborate(self, platform) -> Module: ...


class Streams(Protocol):
    """A board without its UART."""

    i: stream.Interface
    o: stream.Interface
    busy: Signal

    def elaborate(self, platform) -> Module: ...


class DirectBoard(wiring.Component):
    """A linked core and memory on the chip: a board without its UART.

    Members
    -------
    i : In(stream of bytes), taken at once
    o : Out(stream of bytes)
    busy : Out(1), a run is under way
    """

    i: stream.Interface
    o: stream.Interface
    busy: Signal

    def __init__(self, core: LinkedCore, config: Config, *, words: int):
        self.core = core
        self.memory = ChipMemory(config, words=words)
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            "o": Out(stream.Signature(8)),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.core = core = self.core
        m.submodules.memory = memory = self.memory
        wiring.connect(m, wiring.flipped(self.i), core.i)
        wiring.connect(m, core.o, wiring.flipped(self.o))
        wiring.connect(m, core.port, memory.port)
        m.d.comb += self.busy.eq(core.busy)
        return m


class BoardBench(wiring.Component):
    """A board and line_model.v, whose ports it has.

    Members
    -------
    push, push_bytes, pull, waiting, received, pulled, pull_bytes, framing_errors, idle, lull :
        As in line_model.v.
    stop : Out(1), idle or lull
    """

    idle: Signal
    lull: Signal
    stop: Signal

    def __init__(self, unit: Pins | Streams):
        self.unit = unit
        super().__init__({
            **{"push": In(16), "push_bytes": In(8 * BULK), "pull": In(1)},
            **{"waiting": Out(16), "received": Out(16)},
            **{"pulled": Out(16), "pull_bytes": Out(8 * BULK)},
            **{"framing_errors": Out(32), "idle": Out(1), "lull": Out(1), "stop": Out(1)},
        })

    @property
    def byte_cycles(self) -> float:
        """Cycles that a byte takes on the line."""
        return 1

    def _ends(self) -> dict:
        """Parameters and ports of the line model, for the line of this board."""
        raise NotImplementedError

    def elaborate(self, platform):
        m = Module()
        m.submodules.unit = unit = self.unit
        given = "push", "push_bytes", "pull"
        m.submodules.line = Instance(
            "line_model",
            p_BULK=BULK,
            p_DEPTH=DEPTH,
            i_clk=ClockSignal(),
            i_rst=ResetSignal(),
            i_busy=unit.busy,
            **{f"i_{k}": getattr(self, k) for k in given},
            **{
                f"o_{k}": getattr(self, k)
                for k in self.signature.members
                if k not in given + ("stop",)
            },
            **self._ends(),
        )
        m.d.comb += self.stop.eq(self.idle | self.lull)
        return m


class PinsBench(BoardBench):
    """With the UART of the board.

    Parameters
    ----------
    unit : Pins
    bit_cycles : float
        Length of a bit.
    """

    def __init__(self, unit: Pins, bit_cycles: float):
        super().__init__(unit)
        self.pins = unit
        self.bit_cycles = bit_cycles

    @property
    def byte_cycles(self) -> float:
        """With start and stop."""
        return 10 * self.bit_cycles

    def _ends(self):
        return {
            "p_BIT_TIME": round(self.bit_cycles * FINENESS),
            "o_to_pin": self.pins.rx,
            "i_from_pin": self.pins.tx,
        }


class DirectBench(BoardBench):
    """Of a board without its UART: a byte in two cycles to it, one a cycle from it.

    Parameters
    ----------
    unit : Streams
    """

    def __init__(self, unit: Streams):
        super().__init__(unit)
        self.streams = unit

    def _ends(self):
        i, o = self.streams.i, self.streams.o
        return {
            "p_DIRECT": 1,
            **{"o_to_valid": i.valid, "i_to_ready": i.ready, "o_to_payload": i.payload},
            **{"i_from_valid": o.valid, "o_from_ready": o.ready, "i_from_payload": o.payload},
        }
