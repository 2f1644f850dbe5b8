"""Reads the instruction stream ahead of its use."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.isa import INSTRUCTION_BITS
from hdl.memory.port import Port, PortInterface
from hdl.records import instructions_per_word

BLOCK_BITS = 2
BLOCK = 1 << BLOCK_BITS
"""Words that are asked for together, from a multiple of it on: memories like their neighbours."""


def program(config: Config) -> data.StructLayout:
    """Where a program lies: the address of its first word, and its length in instructions."""
    slot_bits = (instructions_per_word(config.fmt) - 1).bit_length()
    return data.StructLayout({
        "address": config.address_bits,
        "length": config.address_bits + slot_bits,
    })


class Fetch(wiring.Component):
    """Reads the words of a program and gives its instructions in order.

    One instruction a cycle once the first word is there, as long as the memory answers within
    `config.latency` cycles and serves one word in `instructions_per_word`. Never reads past the
    last word of the program. The first instruction comes 2 cycles after its word.

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
        self.depth = -(-(config.latency + 6) // self.slots) + 2 + BLOCK - 1
        super().__init__({
            "i": In(stream.Signature(program(config))),
            "o": Out(stream.Signature(INSTRUCTION_BITS)),
            "port": Out(Port(config)),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        m.submodules.words = words = fifo.SyncFIFO(width=len(response.payload), depth=self.depth)
        unread = Signal.like(self.i.p.length)  # instructions whose words are not asked for
        left = Signal.like(self.i.p.length)  # instructions not given
        room = Signal(range(self.depth + 1), init=self.depth)  # words that no one has asked for
        address = Signal.like(request.p.address, reset_less=True)
        slot = Signal(range(self.slots))
        begins = Signal()  # the next word is the first of a block
        step = Signal()
        m.d.comb += [
            self.idle.eq((left == 0) & ~self.o.valid),
            self.i.ready.eq(self.idle),
            begins.eq(address[:BLOCK_BITS] == 0),  # all is free where a program begins within one
            request.valid.eq((unread != 0) & (~begins | (room >= BLOCK))),
            request.p.address.eq(address),
            words.w_en.eq(response.valid),
            words.w_data.eq(response.payload),
            response.ready.eq(1),
            step.eq(~self.o.valid | self.o.ready),
        ]

        asked = request.valid & request.ready
        with m.If(asked):
            m.d.sync += [
                address.eq(address + 1),
                unread.eq(Mux(unread < self.slots, 0, unread - self.slots)),
            ]
        m.d.sync += room.eq(room - asked + words.r_en)

        with m.If(step):
            m.d.sync += [
                self.o.valid.eq(words.r_rdy),
                self.o.payload.eq(words.r_data.word_select(slot, INSTRUCTION_BITS)),
            ]
            with m.If(words.r_rdy):
                last = (slot == self.slots - 1) | (left == 1)
                m.d.comb += words.r_en.eq(last)
                m.d.sync += [left.eq(left - 1), slot.eq(Mux(last, 0, slot + 1))]

        with m.If(self.i.valid & self.i.ready):
            m.d.sync += [
                address.eq(self.i.p.address),
                unread.eq(self.i.p.length),
                left.eq(self.i.p.length),
            ]
        return m
