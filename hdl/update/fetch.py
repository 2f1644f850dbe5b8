"""Reads the instruction stream ahead of its use."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.config import Config
from hdl.isa import INSTRUCTION_BITS
from hdl.memory.ahead import Ahead
from hdl.memory.port import Port, PortInterface
from hdl.records import instructions_per_word

BLOCK = 4
"""Words that are asked for together, from a multiple of it on."""


def program(config: Config) -> data.StructLayout:
    """Where a program lies: the address of its first word, and its length in instructions."""
    slot_bits = exact_log2(instructions_per_word(config.fmt))
    return data.StructLayout({
        "address": config.address_bits,
        "length": config.address_bits + slot_bits,
    })


class Fetch(wiring.Component):
    """Reads the words of a program and gives its instructions in order.

    One instruction a cycle once the first word is there, as long as the memory answers within
    `config.latency` cycles and serves one word in `instructions_per_word`. Never reads past the
    last word of the program. The first instruction comes a cycle after its word.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of program), taken when all of the last one has been given
    o : Out(stream of instructions)
    port : Out(Port), reads only
    idle : Out(1), nothing left to give
    """

    i: stream.Interface
    o: stream.Interface
    port: PortInterface
    idle: Signal

    def __init__(self, config: Config):
        self.config = config
        self.slots = instructions_per_word(config.fmt)
        # Words that the memory's latency and that of the units on the way to it ask for, two for
        # the word in use and the one that follows it, and those that wait to be a block.
        self.depth = -(-(config.latency + 8) // self.slots) + 2 + BLOCK
        super().__init__({
            "i": In(stream.Signature(program(config))),
            "o": Out(stream.Signature(INSTRUCTION_BITS)),
            "port": Out(Port(config)),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.words = words = Ahead(self.config, depth=self.depth, block=BLOCK)
        wiring.connect(m, words.port, wiring.flipped(self.port))
        left = Signal.like(self.i.p.length)  # instructions not given
        some = Signal()  # left is not 0
        slot = Signal(range(self.slots))
        last = Signal()  # the next instruction is the last that is wanted of its word
        m.d.comb += [
            self.idle.eq(~some),
            self.i.ready.eq(~some),
            words.i.valid.eq(self.i.valid & ~some),  # ready, since all words have been used
            words.i.p.address.eq(self.i.p.address),
            words.i.p.words.eq((self.i.p.length + self.slots - 1) >> exact_log2(self.slots)),
            words.o.ready.eq(self.o.ready & last),
            self.o.valid.eq(words.o.valid),
            self.o.payload.eq(words.o.payload.word_select(slot, INSTRUCTION_BITS)),
        ]
        with m.If(~some):
            m.d.sync += [
                left.eq(self.i.p.length),
                some.eq(self.i.valid & (self.i.p.length != 0)),
                last.eq(self.i.p.length == 1),
            ]
        with m.Elif(self.o.valid & self.o.ready):
            m.d.sync += [
                left.eq(left - 1),
                some.eq(left != 1),
                slot.eq(Mux(last, 0, slot + 1)),
                last.eq((slot == self.slots - 2) | (left == 2)),
            ]
        return m
