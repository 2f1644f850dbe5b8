"""Tagged reads from a memory port of their own."""

from amaranth import *
from amaranth.lib import fifo, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface, Reads, ReadsInterface


class InOrder(wiring.Component):
    """Gives each word that comes from memory the tag that it was asked with.

    Takes no cycle of its own; one request and one response a cycle.

    Parameters
    ----------
    config : Config
    tags : int
        Number of tags of the reader.
    outstanding : int
        Reads that can be under way together, at least 1. One more waits.

    Members
    -------
    reads : In(Reads)
    port : Out(Port), reads only
    """

    reads: ReadsInterface
    port: PortInterface

    def __init__(self, config: Config, *, tags: int, outstanding: int):
        if outstanding < 1:
            raise ValueError(f"at least one read under way, not {outstanding}")
        self.outstanding = outstanding
        super().__init__({"reads": In(Reads(config, tags)), "port": Out(Port(config))})

    def elaborate(self, platform):
        m = Module()

        request, response = self.reads.request, self.reads.response
        m.submodules.tags = tags = fifo.SyncFIFO(width=len(request.p.tag), depth=self.outstanding)
        m.d.comb += [
            self.port.request.valid.eq(request.valid & tags.w_rdy),
            self.port.request.p.address.eq(request.p.address),
            request.ready.eq(self.port.request.ready & tags.w_rdy),
            tags.w_en.eq(request.valid & request.ready),
            tags.w_data.eq(request.p.tag),
            response.valid.eq(self.port.response.valid),
            response.p.tag.eq(tags.r_data),
            response.p.word.eq(self.port.response.payload),
            tags.r_en.eq(response.valid),
        ]
        return m
