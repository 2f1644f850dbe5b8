"""What a board holds: a core, memory on the chip, and the way to another computer."""

from collections.abc import Sequence
from dataclasses import dataclass

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.core import Core
from hdl.link.uart import Transmitter
from hdl.memory.arbiter import Arbiter
from hdl.memory.onchip import OnChip
from hdl.sequencer import Sequencer


@dataclass(frozen=True)
class Content:
    """What a board is configured with.

    Attributes
    ----------
    words : sequence of int
        Memory from address 0 on.
    job : int
        Bits of the frame_job that it runs.
    hits, rays : int
        Address of the first hit record of the job, and their number.
    """

    words: Sequence[int]
    job: int
    hits: int
    rays: int


class Board(wiring.Component):
    """Runs a frame after reset and at each press of a button, and sends its hits.

    After each frame the hit records leave by the serial line: the words as they lie in memory, the
    lowest byte first, 8N1.

    ::

        core ──────┐
                   ├─► arbiter ─► memory on the chip
        sequencer ─┘
            └─► transmitter ─► tx

    Parameters
    ----------
    config : Config
        With caches: the memory has one port.
    words : int
        Size of the memory.
    content : Content
    clock_hz, baud : float

    Members
    -------
    button : In(1), pressed
    tx : Out(1), the serial line
    busy : Out(1), a frame is under way
    sends : Out(1), its hits are
    frames : Out(8), that were run
    """

    button: Signal
    tx: Signal
    busy: Signal
    sends: Signal
    frames: Signal

    def __init__(
        self, config: Config, *, words: int, content: Content, clock_hz: float, baud: float
    ):
        if not config.cache_words:
            raise ValueError("memory with one port wants a configuration with caches")
        self.config = config
        self.memory = OnChip(config, words=words, init=content.words)
        self.sequencer = Sequencer(config, job=content.job, first=content.hits, count=content.rays)
        self.transmitter = Transmitter(clock_hz=clock_hz, baud=baud)
        self.hold = round(clock_hz / 100)
        super().__init__({
            "button": In(1),
            **dict.fromkeys(("tx", "busy", "sends"), Out(1)),
            "frames": Out(8),
        })

    def elaborate(self, platform):
        m = Module()
        config = self.config

        m.submodules.core = core = Core(config)
        m.submodules.memory = on_chip = self.memory
        m.submodules.sequencer = sequencer = self.sequencer
        m.submodules.transmitter = transmitter = self.transmitter
        m.submodules.arbiter = arbiter = Arbiter(config, clients=2, outstanding=OnChip.latency + 2)
        wiring.connect(m, core.port, arbiter.clients[0])
        wiring.connect(m, sequencer.port, arbiter.clients[1])
        wiring.connect(m, arbiter.port, on_chip.port)
        wiring.connect(m, sequencer.o_job, core.i)
        wiring.connect(m, sequencer.o, transmitter.i)

        # A press counts at once. The next one has to follow 10 ms of a button at rest.
        rest, begun = Signal(range(self.hold + 1)), Signal()
        with m.If(self.button):
            m.d.sync += rest.eq(self.hold)
        with m.Elif(rest != 0):
            m.d.sync += rest.eq(rest - 1)
        m.d.sync += begun.eq(1)
        m.d.comb += [
            sequencer.start.eq(~begun | (self.button & (rest == 0))),
            sequencer.core_busy.eq(core.busy),
            self.tx.eq(transmitter.tx),
            self.busy.eq(sequencer.running),
            self.sends.eq(sequencer.giving | transmitter.busy),
            self.frames.eq(sequencer.frames),
        ]
        return m
