"""Bytes to and from words of memory, and registers."""

from amaranth import *
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.bus.signals import LITE_BITS, Registers, RegistersInterface
from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.records import word_bits

COUNT_BITS = 16


def order(config: Config) -> data.StructLayout:
    """What a Transfer is asked to do.

    `count` words from `address` on, at least 1, and of each the bytes from `first` to before
    `past`, at least 1, are written or read. Registers are words of 4 bytes, of which all count.
    """
    lanes = word_bits(config.fmt) // 8
    return data.StructLayout({
        "address": config.address_bits,
        "count": COUNT_BITS,
        "first": range(lanes),
        "past": range(lanes + 1),
        "write": 1,
        "registers": 1,
    })


class Step(enum.Enum, shape=2):
    """Of a word."""

    WAIT = 0  # for an order
    BYTES = 1  # go to or from the word
    ASK = 2  # memory or registers
    ANSWER = 3  # comes


class Transfer(wiring.Component):
    """Reads words and gives their bytes, or takes bytes and writes them: one word after the other.

    A word takes a cycle for each byte up to the last one that is read, or for each that it has, if
    it is written, and as long as bytes are waited for; 2 more, and what the memory takes.

    Parameters
    ----------
    config : Config
    register_bits : int
        Of the address of a register, at most those of the address of a word.

    Members
    -------
    i : In(stream of order), the next one is taken when the one before is done
    stop : In(1), no more bytes come or none is wanted: the order is done, without the word that
        waits for a byte or gives one
    i_bytes : In(stream of bytes), to write
    o_bytes : Out(stream of bytes), that were read, taken at once
    port : Out(Port)
    registers : Out(Registers)
    """

    i: stream.Interface
    stop: Signal
    i_bytes: stream.Interface
    o_bytes: stream.Interface
    port: PortInterface
    registers: RegistersInterface

    def __init__(self, config: Config, *, register_bits: int):
        self.lanes = word_bits(config.fmt) // 8
        super().__init__({
            "i": In(stream.Signature(order(config))),
            "stop": In(1),
            "i_bytes": In(stream.Signature(8)),
            "o_bytes": Out(stream.Signature(8, always_ready=True)),
            "port": Out(Port(config)),
            "registers": Out(Registers(register_bits)),
        })

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        step = Signal(Step)
        job = Signal.like(self.i.p, reset_less=True)  # address and count: of what is to be done
        lane = Signal(range(self.lanes))
        # These are known before the first byte: what asks for a word has them too.
        word = Signal.like(response.payload)  # its next byte is the lowest
        mask = Signal.like(request.p.mask)
        inside = Signal()  # the lane is one of those that count
        moves = Signal()  # the word, by a lane
        ends = Signal()  # the word does
        whole = job.write & ~job.registers  # all lanes pass, so that bytes get where they belong
        m.d.comb += [
            self.i.ready.eq(step == Step.WAIT),
            inside.eq((lane >= job.first) & (lane < job.past)),
            self.i_bytes.ready.eq((step == Step.BYTES) & inside & job.write),
            self.o_bytes.valid.eq((step == Step.BYTES) & inside & ~job.write),
            self.o_bytes.payload.eq(word[:8]),
            moves.eq(~inside | ~job.write | self.i_bytes.valid),
            request.valid.eq((step == Step.ASK) & ~job.registers),
            request.p.address.eq(job.address),
            request.p.write.eq(job.write),
            request.p.mask.eq(mask),
            request.p.data.eq(word),
            self.registers.address.eq(job.address),
            self.registers.write.eq((step == Step.ASK) & job.registers & job.write),
            self.registers.write_data.eq(word[-LITE_BITS:]),
        ]
        with m.Switch(step):
            with m.Case(Step.WAIT):
                m.d.sync += [job.eq(self.i.p), lane.eq(0)]
                with m.If(self.i.valid):
                    m.d.sync += step.eq(Mux(self.i.p.write, Step.BYTES, Step.ASK))
            with m.Case(Step.BYTES):
                with m.If(moves):
                    m.d.sync += [
                        word.eq(Cat(word[8:], self.i_bytes.payload)),  # of no meaning outside
                        mask.eq(Cat(mask[1:], inside)),
                        lane.eq(lane + 1),
                    ]
                    with m.If(lane == Mux(whole, self.lanes - 1, job.past - 1)):
                        m.d.sync += step.eq(Step.ASK)
                        m.d.comb += ends.eq(~job.write)
                with m.If(self.stop):
                    m.d.sync += step.eq(Step.WAIT)
            with m.Case(Step.ASK):
                with m.If(job.registers | request.ready):
                    m.d.sync += step.eq(Mux(job.write, Step.BYTES, Step.ANSWER))
                    m.d.comb += ends.eq(job.write)
            with m.Case(Step.ANSWER):
                m.d.sync += word.eq(Mux(job.registers, self.registers.read_data, response.payload))
                with m.If(job.registers | response.valid):
                    m.d.sync += step.eq(Step.BYTES)
        with m.If(ends):
            m.d.sync += [
                job.address.eq(job.address + 1),
                job.count.eq(job.count - 1),
                lane.eq(0),
            ]
            with m.If(job.count == 1):
                m.d.sync += step.eq(Step.WAIT)
        return m
