"""A read cache whose hits overtake its misses."""

from amaranth import *
from amaranth.lib import data, fifo, memory, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.config import Config
from hdl.memory.port import Port, PortInterface, Reads, ReadsInterface
from hdl.records import word_bits
from hdl.stream import Slice


class Cache(wiring.Component):
    """Direct-mapped read cache of single words. The memory behind it must not change meanwhile.

    A hit takes `latency` cycles; one request a cycle. A miss takes twice that, three more and what
    the memory takes, and does not hold up what comes after it. A word that is on its way is asked
    for again.

    Parameters
    ----------
    config : Config
    words : int
        Size in words, a power of two.
    tags : int
        Number of tags of the reader.
    misses : int
        Reads that can be under way together, those that turn out to be hits among them.

    Members
    -------
    reads : In(Reads)
    port : Out(Port), reads only
    clear : In(1), forget everything, as after reset: takes `words` + 1 cycles without a request
    hits, misses : Out(32), requests since the last clear, a cycle after the hit or miss is known
    """

    latency = 3
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

        # Misses wait for the port, and then for their words.
        asks = fifo.SyncFIFO(width=len(request.p.as_value()), depth=self.under_way)
        pending = fifo.SyncFIFO(width=asks.width, depth=self.under_way)
        m.submodules.asks, m.submodules.pending = asks, pending
        m.submodules.next_ask = next_ask = Slice(self.config.address_bits)
        asked = Signal.like(request.p)
        filled = self.port.response.valid
        m.d.comb += [
            next_ask.i.valid.eq(asks.r_rdy),
            next_ask.i.p.eq(data.View(asked.shape(), asks.r_data).address),
            asks.r_en.eq(next_ask.i.ready),
            self.port.request.valid.eq(next_ask.o.valid),
            self.port.request.p.address.eq(next_ask.o.p),
            next_ask.o.ready.eq(self.port.request.ready),
            pending.w_en.eq(asks.r_rdy & asks.r_en),  # there is room, since there was in `asks`
            pending.w_data.eq(asks.r_data),
            asked.eq(pending.r_data),
            pending.r_en.eq(filled),
        ]

        # stage 0: choose. What has come from memory is in its line now: it is looked up again.
        stages = data.StructLayout({"valid": 1, "again": 1, "request": request.p.shape()})
        s0, s1, s2 = (Signal(stages, name=f"s{k}") for k in range(3))
        clearing = Signal(init=1)
        room = Signal(range(self.under_way + 1), init=self.under_way)
        free = Signal()  # there is room, and nothing is cleared
        taken = request.valid & request.ready
        again = Signal(stages)
        m.d.sync += [again.valid.eq(filled), again.request.eq(asked)]
        m.d.comb += [
            again.again.eq(1),
            request.ready.eq(~again.valid & free),
            s0.valid.eq(taken),
            s0.request.eq(request.p),
        ]
        with m.If(again.valid):
            m.d.comb += s0.eq(again)

        # stage 1: read the line; stage 2: keep it, since it comes late
        found = Signal(line, reset_less=True)
        m.d.comb += reads.addr.eq(s0.request.address[:index_bits])
        m.d.sync += [s1.eq(s0), s2.eq(s1), found.eq(reads.data)]

        # the last stage: give the word, or ask for it
        hit, looked_up = Signal(), Signal()
        m.d.comb += [
            hit.eq(found.valid & (found.upper == s2.request.address[index_bits:])),
            looked_up.eq(s2.valid & ~s2.again),
        ]
        given = s2.valid & (s2.again | hit)
        was_hit = Signal()
        m.d.sync += [
            asks.w_en.eq(looked_up & ~hit),
            asks.w_data.eq(s2.request),
            was_hit.eq(looked_up & hit),
            response.valid.eq(given),
            response.p.tag.eq(s2.request.tag),
            response.p.word.eq(found.word),
            room.eq(room - taken + given),
            free.eq(Mux(taken, room > 1, room != 0) & ~clearing & ~self.clear),
            self.hits.eq(self.hits + was_hit),
            self.misses.eq(self.misses + asks.w_en),
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
                writes.en.eq(filled),
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
