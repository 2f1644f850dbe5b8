"""The numbers of packets that are not under way."""

from amaranth import *
from amaranth.lib import fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.rays.packet import packet_bits


class Numbers(wiring.Component):
    """Gives each packet number that is free: all of them after reset, then those that come back.

    One a cycle; a number that comes back can be given the cycle after.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of packets), given before; taken at once
    o : Out(stream of packets)
    """

    i: stream.Interface
    o: stream.Interface

    def __init__(self, config: Config):
        self.config = config
        packet = packet_bits(config)
        super().__init__({
            "i": In(stream.Signature(packet, always_ready=True)),
            "o": Out(stream.Signature(packet)),
        })

    def elaborate(self, platform):
        m = Module()

        packets = self.config.packets
        m.submodules.returned = returned = fifo.SyncFIFO(width=len(self.i.p), depth=packets)
        fresh = Signal(range(packets + 1))
        unused = fresh != packets
        given = self.o.valid & self.o.ready
        m.d.comb += [
            returned.w_en.eq(self.i.valid),  # there are no more numbers than it holds
            returned.w_data.eq(self.i.p),
            returned.r_en.eq(given & ~unused),
            self.o.valid.eq(unused | returned.r_rdy),
            self.o.p.eq(Mux(unused, fresh, returned.r_data)),
        ]
        m.d.sync += fresh.eq(fresh + (given & unused))
        return m
