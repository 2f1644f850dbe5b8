"""Runs one and the same frame, and gives what it came to: a machine without a host."""

from amaranth import *
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.core import frame_job
from hdl.memory.port import Port, PortInterface
from hdl.records import word_bits


class Phase(enum.Enum, shape=2):
    """What is being done."""

    IDLE = 0
    RUN = 1  # the core works
    READ = 2  # a word is on its way
    GIVE = 3  # its bytes are


class Sequencer(wiring.Component):
    """Runs a job on a core, then reads words from memory and gives their bytes, the lowest first.

    Parameters
    ----------
    config : Config
    job : int
        Bits of a frame_job.
    first, count : int
        Address of the first word to give, and number of words, at least 1.

    Members
    -------
    start : In(1), begin; means nothing while at work
    running, giving : Out(1), the core works; bytes are given
    frames : Out(8), that were run
    o_job : Out(stream of frame_job)
    core_busy : In(1)
    port : Out(Port), reads only
    o : Out(stream of bytes)
    """

    start: Signal
    running: Signal
    giving: Signal
    frames: Signal
    o_job: stream.Interface
    core_busy: Signal
    port: PortInterface
    o: stream.Interface

    def __init__(self, config: Config, *, job: int, first: int, count: int):
        if count < 1 or first < 0 or first + count > 1 << config.address_bits:
            raise ValueError(f"words {first} to {first + count - 1} are none, or not in memory")
        self.config = config
        self.job = job
        self.first = first
        self.count = count
        super().__init__({
            "start": In(1),
            **dict.fromkeys(("running", "giving"), Out(1)),
            "frames": Out(8),
            "o_job": Out(stream.Signature(frame_job(config))),
            "core_busy": In(1),
            "port": Out(Port(config)),
            "o": Out(stream.Signature(8)),
        })

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        size = word_bits(self.config.fmt) // 8
        phase, taken = Signal(Phase), Signal()  # the core has the job; memory has the request
        left = Signal(range(self.count + 1))
        word, number = Signal(8 * size, reset_less=True), Signal(range(size))
        m.d.comb += [
            self.running.eq(phase == Phase.RUN),
            self.giving.eq((phase == Phase.READ) | (phase == Phase.GIVE)),
            self.o_job.valid.eq(self.running & ~taken),
            self.o_job.payload.eq(self.job),
            request.valid.eq((phase == Phase.READ) & ~taken),
            self.o.valid.eq(phase == Phase.GIVE),
            self.o.payload.eq(word),
        ]
        with m.Switch(phase):
            with m.Case(Phase.IDLE):
                m.d.sync += [request.p.address.eq(self.first), left.eq(self.count)]
                with m.If(self.start):
                    m.d.sync += phase.eq(Phase.RUN)
            with m.Case(Phase.RUN):
                with m.If(self.o_job.ready):
                    m.d.sync += taken.eq(1)
                with m.If(taken & ~self.core_busy):
                    m.d.sync += [phase.eq(Phase.READ), taken.eq(0), self.frames.eq(self.frames + 1)]
            with m.Case(Phase.READ):
                with m.If(request.ready):
                    m.d.sync += taken.eq(1)
                with m.If(response.valid):
                    m.d.sync += [phase.eq(Phase.GIVE), taken.eq(0), word.eq(response.payload)]
                    m.d.sync += [request.p.address.eq(request.p.address + 1), left.eq(left - 1)]
            with m.Case(Phase.GIVE):
                with m.If(self.o.ready):
                    m.d.sync += [word.eq(word >> 8), number.eq(number + 1)]
                    with m.If(number == size - 1):
                        m.d.sync += [
                            number.eq(0),
                            phase.eq(Mux(left == 0, Phase.IDLE, Phase.READ)),
                        ]
        return m
