"""What a board holds: a machine, memory, and the serial line to its host."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hdl.bus.axi import AxiMaster
from hdl.bus.reader import axi
from hdl.bus.signals import Axi4Interface
from hdl.config import Config
from hdl.identification import Surroundings
from hdl.link.uart import Receiver, Transmitter
from hdl.linked import LinkedCore
from hdl.memory.onchip import OnChip


class Board(wiring.Component):
    """A machine that a host commands over a serial line: 8N1, the frames of hdl.link.protocol.

    ::

        rx ─► receiver ────► linked core ─► memory on the chip, or m_axi
        tx ◄─ transmitter ◄──┘

    Parameters
    ----------
    config : Config
        With caches: the memory has one port.
    words : int
        Of the memory.
    clock_hz, baud : float
    on_chip : bool
        The memory is block RAM; else it is behind `m_axi`.

    Members
    -------
    rx : In(1), the line from the host: of any clock
    tx : Out(1), that to it
    busy : Out(1), a run is under way
    executed : Out(32), commands since reset
    m_axi : Out(Axi4), where the memory is not on the chip
    """

    rx: Signal
    tx: Signal
    busy: Signal
    executed: Signal
    m_axi: Axi4Interface

    def __init__(
        self, config: Config, *, words: int, clock_hz: float, baud: float, on_chip: bool = True
    ):
        self.config = config
        self.words = words
        self.on_chip = on_chip
        self.core = LinkedCore(config, Surroundings(words, round(clock_hz)))
        self.receiver = Receiver(clock_hz=clock_hz, baud=baud)
        self.transmitter = Transmitter(clock_hz=clock_hz, baud=baud)
        super().__init__({
            "rx": In(1),
            "tx": Out(1),
            "busy": Out(1),
            "executed": Out(32),
            **({} if on_chip else {"m_axi": Out(axi(config))}),
        })

    def memory(self) -> OnChip:
        """The memory on the chip, to be made one of this component's parts."""
        return OnChip(self.config, words=self.words)

    def elaborate(self, platform):
        m = Module()

        m.submodules.core = core = self.core
        memory = self.memory() if self.on_chip else AxiMaster(self.config)
        m.submodules.memory = memory
        m.submodules.receiver = receiver = self.receiver
        m.submodules.transmitter = transmitter = self.transmitter
        wiring.connect(m, receiver.o, core.i)
        wiring.connect(m, core.o, transmitter.i)
        wiring.connect(m, core.port, memory.port)
        m.d.comb += [
            receiver.rx.eq(self.rx),
            core.framing_error.eq(receiver.framing_error),
            self.tx.eq(transmitter.tx),
            self.busy.eq(core.busy),
            self.executed.eq(core.executed),
        ]
        if isinstance(memory, AxiMaster):
            wiring.connect(m, memory.axi, wiring.flipped(self.m_axi))
            m.d.comb += [
                core.unsettled.eq(~memory.settled),
                core.read_failed.eq(memory.read_failed),
                core.write_failed.eq(memory.write_failed),
            ]
        return m
