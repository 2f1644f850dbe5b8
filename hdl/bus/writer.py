"""The write half of an AXI4 master."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.bus.gather import BEATS, Gather
from hdl.bus.reader import address, axi
from hdl.bus.signals import Axi4Interface
from hdl.config import Config
from hdl.records import word_bits

MOST = 64
"""Bursts that can wait for their response together."""


def write(config: Config) -> data.StructLayout:
    """Bytes of a word, those with a set bit in `mask`."""
    bits = word_bits(config.fmt)
    return data.StructLayout({"address": config.address_bits, "mask": bits // 8, "data": bits})


class AxiWriter(wiring.Component):
    """Writes words in bursts. One word a cycle.

    A burst begins on the bus when all of its words are there, so that it can always be finished.
    As nobody waits for writes, it waits `patience` cycles for more of them.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of write)
    axi : Out(Axi4), of which only the write channels are used
    settled : Out(1), all writes have been answered
    failed : Out(1), a burst is answered with an error
    """

    patience = 15
    i: stream.Interface
    axi: Axi4Interface
    settled: Signal
    failed: Signal

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "i": In(stream.Signature(write(config))),
            "axi": Out(axi(config)),
            "settled": Out(1),
            "failed": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        bus, i = self.axi, self.i
        beat = data.StructLayout({"mask": i.p.mask.shape(), "data": i.p.data.shape()})
        m.submodules.gather = gather = Gather(self.config, self.patience)
        # Never full: it holds a burst that grows, and one on the bus.
        m.submodules.beats = beats = fifo.SyncFIFO(width=beat.size, depth=2 * BEATS)
        entering = Signal(beat)
        leaving = Signal(beat)
        m.d.comb += [
            gather.i.valid.eq(i.valid),
            gather.i.p.eq(i.p.address),
            i.ready.eq(gather.i.ready),
            entering.mask.eq(i.p.mask),
            entering.data.eq(i.p.data),
            beats.w_en.eq(i.valid & i.ready),
            beats.w_data.eq(entering),
            leaving.eq(beats.r_data),
        ]

        # A burst stays in the gatherer until its address and all of its words are taken.
        unanswered = Signal(range(MOST + 1))
        address_sent = Signal()
        words_sent = Signal()
        number = Signal.like(gather.o.p.more)
        may_send = gather.o.valid & (unanswered != MOST)
        address_goes = bus.awvalid & bus.awready
        word_goes = bus.wvalid & bus.wready
        sent = gather.o.ready
        m.d.comb += [
            *address(self.config, bus, "aw", gather.o.p),
            bus.awvalid.eq(may_send & ~address_sent),
            bus.wvalid.eq(may_send & ~words_sent),
            bus.wdata.eq(leaving.data),
            bus.wstrb.eq(leaving.mask),
            bus.wlast.eq(number == gather.o.p.more),
            beats.r_en.eq(word_goes),
            sent.eq((address_sent | address_goes) & (words_sent | (word_goes & bus.wlast))),
            bus.bready.eq(1),
            self.settled.eq(gather.empty & (unanswered == 0)),
            self.failed.eq(bus.bvalid & Value.cast(bus.bresp)[1]),
        ]
        m.d.sync += [
            address_sent.eq(~sent & (address_sent | address_goes)),
            words_sent.eq(~sent & (words_sent | (word_goes & bus.wlast))),
            unanswered.eq(unanswered + sent - bus.bvalid),
        ]
        with m.If(word_goes):
            m.d.sync += number.eq(Mux(bus.wlast, 0, number + 1))
        return m
