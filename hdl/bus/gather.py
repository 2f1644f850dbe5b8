"""Addresses to bursts."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.config import Config
from hdl.records import word_bits

BEATS = 16
"""Most words of a burst."""

PAGE = 4096
"""Bytes of which a burst crosses no multiple."""


def burst(config: Config) -> data.StructLayout:
    """Words at an address and the `more` that follow it."""
    return data.StructLayout({"address": config.address_bits, "more": exact_log2(BEATS)})


class Gather(wiring.Component):
    """Joins addresses that follow one another to bursts.

    One address a cycle. A burst ends at BEATS words, at a multiple of PAGE bytes, at an address
    that does not follow, and when no address has come for `patience` cycles, but not before it can
    leave: as long as the one before it waits, it grows. Then it takes 2 cycles and that patience.

    Parameters
    ----------
    config : Config
    patience : int

    Members
    -------
    i : In(stream of addresses, in words)
    o : Out(stream of burst)
    empty : Out(1), no burst that has not been taken
    """

    i: stream.Interface
    o: stream.Interface
    empty: Signal

    def __init__(self, config: Config, patience: int):
        self.config = config
        self.patience = patience
        super().__init__({
            "i": In(stream.Signature(config.address_bits)),
            "o": Out(stream.Signature(burst(config))),
            "empty": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        i, o = self.i, self.o
        page_bits = exact_log2(PAGE * 8 // word_bits(self.config.fmt))
        growing = Signal()
        grown = Signal.like(o.p, reset_less=True)
        follower = Signal.like(i.p, reset_less=True)  # the next address of the burst
        waited = Signal(range(self.patience + 1))
        full = Signal()
        extends = Signal()
        ends = Signal()
        leaves = Signal()
        m.d.comb += [
            full.eq((grown.more == BEATS - 1) | (follower[:page_bits] == 0)),
            extends.eq(growing & i.valid & (i.p == follower) & ~full),
            ends.eq(i.valid | full | (waited == self.patience)),
            leaves.eq(growing & ~extends & ends & (~o.valid | o.ready)),
            i.ready.eq(~growing | extends | leaves),
            self.empty.eq(~growing & ~o.valid),
        ]
        with m.If(o.ready):
            m.d.sync += o.valid.eq(0)
        with m.If(leaves):
            m.d.sync += [o.valid.eq(1), o.p.eq(grown), growing.eq(0)]
        with m.If(i.valid & i.ready):
            m.d.sync += [
                growing.eq(1),
                grown.more.eq(Mux(extends, grown.more + 1, 0)),
                grown.address.eq(Mux(extends, grown.address, i.p)),
                follower.eq(i.p + 1),
                waited.eq(0),
            ]
        with m.Elif(waited != self.patience):
            m.d.sync += waited.eq(waited + 1)
        return m
