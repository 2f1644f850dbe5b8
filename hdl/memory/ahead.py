"""Reads words that follow one another ahead of their use."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.records import word_bits


def span(config: Config) -> data.StructLayout:
    """Words that follow one another: the address of the first, and how many they are.

    They can be eight times what is in memory, and then come around.
    """
    return data.StructLayout({"address": config.address_bits, "words": config.address_bits + 3})


class Ahead(wiring.Component):
    """Reads the words of a span, as far ahead as it has room for them.

    Words are asked for in blocks, since memories like neighbours: in one go from a multiple of
    `block` to the next, once there is room for all of them. One word a cycle; the first is asked
    for 2 cycles after its span was taken, and a word is there a cycle after it came. Never reads
    past the end of the span.

    Parameters
    ----------
    config : Config
    depth : int
        Words that are under way or wait at most, more than `block`. The next block is asked for
        once there are fewer than `depth - block`.
    block : int
        A power of two.

    Members
    -------
    i : In(stream of span), taken when all words of the last one have been asked for
    o : Out(stream of words), in order
    port : Out(Port), reads only
    """

    i: stream.Interface
    o: stream.Interface
    port: PortInterface

    def __init__(self, config: Config, *, depth: int, block: int):
        if not 1 <= block < depth:
            raise ValueError(f"more words than a block: depth={depth}, block={block}")
        self.depth = depth
        self.block = block
        super().__init__({
            "i": In(stream.Signature(span(config))),
            "o": Out(stream.Signature(word_bits(config.fmt))),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        m.submodules.words = words = fifo.SyncFIFO(width=len(response.payload), depth=self.depth)
        asked, given = Signal(), Signal()
        m.d.comb += [
            asked.eq(request.valid & request.ready),
            given.eq(self.o.valid & self.o.ready),
            words.w_en.eq(response.valid),
            words.w_data.eq(response.payload),
            self.o.valid.eq(words.r_rdy),
            self.o.payload.eq(words.r_data),
            words.r_en.eq(self.o.ready),
        ]

        # Counts come with what is asked of them, so that nothing is counted on the way to the port.
        left = Signal.like(self.i.p.words)  # words to ask for, the one at the port among them
        some = Signal()  # left is not 0
        free = Signal(range(self.depth + 1), init=self.depth)  # places that no word has or will
        room = Signal(init=1)  # they are a block and the word at the port
        m.d.sync += free.eq(free - asked + given)
        with m.If(asked != given):
            m.d.sync += room.eq(free > Mux(asked, self.block + 1, self.block - 1))
        m.d.comb += self.i.ready.eq(~some)
        with m.If(~some):
            m.d.sync += [
                request.p.address.eq(self.i.p.address),
                left.eq(self.i.p.words),
                some.eq(self.i.valid & (self.i.p.words != 0)),
            ]
        with m.Elif(asked):
            ends = request.p.address[: exact_log2(self.block)].all()
            m.d.sync += [
                request.p.address.eq(request.p.address + 1),
                left.eq(left - 1),
                some.eq(left != 1),
                request.valid.eq((left != 1) & (~ends | room)),
            ]
        with m.Elif(room):
            m.d.sync += request.valid.eq(1)
        return m
