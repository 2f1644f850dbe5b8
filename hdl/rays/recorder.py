"""Writes hits to memory, in the order in which their packets began."""

from amaranth import *
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.rays.packet import RAYS, hit, numbered, packet_bits


class Recorder(wiring.Component):
    """Writes the hits of packets, a word a ray: those of the first packet, of the second, ...

    One in two cycles, each after one cycle.

    Parameters
    ----------
    config : Config

    Members
    -------
    base : In(address), of the hit of the first ray; constant while packets are under way
    clear : In(1), the next packet is the first
    i_begun : In(stream of packets) that begin, taken at once
    i : In(stream of {packet, number, hit}), the four of a packet in order
    o_free : Out(stream of packets), written as a whole; has to be taken at once
    written : Out(32), packets since the last clear
    port : Out(Port), writes only
    """

    base: Signal
    clear: Signal
    i_begun: stream.Interface
    i: stream.Interface
    o_free: stream.Interface
    written: Signal
    port: PortInterface

    def __init__(self, config: Config):
        self.config = config
        packet = packet_bits(config)
        super().__init__({
            "base": In(config.address_bits),
            "clear": In(1),
            "i_begun": In(stream.Signature(packet, always_ready=True)),
            "i": In(stream.Signature(numbered(config, {"hit": hit(config)}))),
            "o_free": Out(stream.Signature(packet, always_ready=True)),
            "written": Out(32),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.places = places = memory.Memory(
            shape=self.config.address_bits, depth=self.config.packets, init=[]
        )
        writes, reads = places.write_port(), places.read_port()
        begun = Signal.like(self.written)
        m.d.comb += [
            writes.en.eq(self.i_begun.valid),
            writes.addr.eq(self.i_begun.p),
            writes.data.eq(begun),
        ]
        m.d.sync += begun.eq(Mux(self.clear, 0, begun + self.i_begun.valid))
        m.d.sync += self.written.eq(Mux(self.clear, 0, self.written + self.o_free.valid))

        # A hit waits for a cycle, until it is known where it goes.
        request = self.port.request
        waiting = Signal.like(self.i.p, reset_less=True)
        m.d.comb += [
            self.i.ready.eq(~request.valid),
            reads.en.eq(self.i.ready),
            reads.addr.eq(self.i.p.packet),
            request.p.address.eq(self.base + Cat(waiting.number, reads.data)),
            request.p.write.eq(1),
            request.p.mask.eq(~0),
            request.p.data.eq(waiting.hit),
        ]
        m.d.sync += [
            self.o_free.valid.eq(request.valid & request.ready & (waiting.number == RAYS - 1)),
            self.o_free.p.eq(waiting.packet),
        ]
        with m.If(self.i.ready):
            m.d.sync += [request.valid.eq(self.i.valid), waiting.eq(self.i.p)]
        with m.Elif(request.ready):
            m.d.sync += request.valid.eq(0)
        return m
