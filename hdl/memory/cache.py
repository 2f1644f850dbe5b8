"""A read cache whose hits overtake its misses."""

from amaranth import *
from amaranth.lib import data, fifo, memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.config import Config
from hdl.memory.port import Port, PortInterface, Reads, ReadsInterface
from hdl.records import word_bits


class Cache(wiring.Component):
    """Direct-mapped read cache of single words. The memory behind it must not change meanwhile.

    A hit takes 2 cycles; one request a cycle. A miss takes 3 cycles and what the memory takes,
    and does not hold up what comes after it. A word that is on its way is asked for again.

    Parameters
    ----------
    config : Config
    words : int
        Size in words, a power of two.
    tags : int
        Number of tags of the reader.
    misses : int
        Reads that can be under way to memory together.

    Members
    -------
    reads : In(Reads)
    port : Out(Port), reads only
    clear : In(1), forget everything, as after reset: takes `words` cycles without a request
    hits, misses : Out(32), requests since the last clear
    """

    reads: ReadsInterface
    port: PortInterface
    clear: Signal
    hits: Signal
    misses: Signal

    def __init__(self, config: Config, *, words: int, tags: int, misses: int):
        if words < 2 or words & (words - 1) or words >> config.address_bits:
            raise ValueError(f"a cache has a power of two of words, at least 2, not {words}")
        self.config = config
        self.words = words
        self.tags = tags
        self.under_way = misses
        super().__init__({
            "reads": In(Reads(config, tags)),
            "port": Out(Port(config)),
            "clear": In(1),
            "hits": Out(32),
            "misses": Out(32),
        })

    def elaborate(self, platform):
        m = Module()
        index_bits = exact_log2(self.words)
        request, response = self.reads.request, self.reads.response

        # A line: whether it holds a word, the upper bits of its address, and the word.
        line = data.StructLayout({
            "valid": 1,
            "upper": self.config.address_bits - index_bits,
            "word": word_bits(self.config.fmt),
        })
        m.submodules.lines = lines = memory.Memory(shape=line, depth=self.words, init=[])
        writes, reads = lines.write_port(), lines.read_port()

        # stage 1: look the line up
        wanted = Signal.like(request.p, reset_less=True)
        waiting = Signal()
        clearing = Signal(init=1)
        step = Signal()
        m.d.comb += [
            request.ready.eq(step & ~clearing),
            reads.en.eq(step),
            reads.addr.eq(request.p.address[:index_bits]),
        ]
        with m.If(step):
            m.d.sync += [
                wanted.eq(request.p),
                waiting.eq(request.valid & request.ready),
            ]

        # stage 2: give the word, or ask for it
        m.submodules.pending = pending = fifo.SyncFIFO(
            width=len(wanted.as_value()), depth=self.under_way
        )
        asked = Signal.like(wanted)
        hit = Signal()
        asks = Signal()
        m.d.comb += [
            hit.eq(waiting & reads.data.valid & (reads.data.upper == wanted.address[index_bits:])),
            asks.eq(waiting & ~hit & pending.w_rdy),
            self.port.request.valid.eq(asks),
            self.port.request.p.address.eq(wanted.address),
            pending.w_en.eq(asks & self.port.request.ready),
            pending.w_data.eq(wanted),
            asked.eq(pending.r_data),
        ]

        # Words from memory go first: they can be kept nowhere.
        filled = self.port.response.valid
        free = Signal()
        m.d.comb += [
            free.eq(~response.valid | response.ready),
            self.port.response.ready.eq(free),
            pending.r_en.eq(filled & free),
            step.eq(~waiting | Mux(hit, free & ~filled, pending.w_en)),
        ]
        with m.If(free):
            m.d.sync += [
                response.valid.eq(filled | hit),
                response.p.tag.eq(Mux(filled, asked.tag, wanted.tag)),
                response.p.word.eq(Mux(filled, self.port.response.payload, reads.data.word)),
            ]
        with m.If(step & waiting):
            m.d.sync += [
                self.hits.eq(self.hits + hit),
                self.misses.eq(self.misses + ~hit),
            ]

        # The lines are written by what comes from memory, and one after the other when cleared.
        clear_index = Signal(index_bits)
        with m.If(clearing):
            m.d.comb += [writes.en.eq(1), writes.addr.eq(clear_index)]
            m.d.sync += [
                clear_index.eq(clear_index + 1),
                clearing.eq(clear_index != self.words - 1),
            ]
        with m.Else():
            m.d.comb += [
                writes.en.eq(pending.r_en),
                writes.addr.eq(asked.address[:index_bits]),
                writes.data.valid.eq(1),
                writes.data.upper.eq(asked.address[index_bits:]),
                writes.data.word.eq(self.port.response.payload),
            ]
        with m.If(self.clear):
            m.d.sync += [
                clearing.eq(1),
                clear_index.eq(0),
                self.hits.eq(0),
                self.misses.eq(0),
            ]
        return m
