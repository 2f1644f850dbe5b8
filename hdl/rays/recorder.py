"""Writes hits to memory, in the order of the rays there."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.rays.hits import numbered
from hdl.rays.packet import RAYS, hit
from hdl.rays.stack import packet_bits


def begun(config: Config) -> data.StructLayout:
    """A packet that begins, and its place among those in memory."""
    return data.StructLayout({"packet": packet_bits(config), "index": config.address_bits})


class Recorder(wiring.Component):
    """Writes the hits of packets, a word a ray at the ray's index; one a cycle, one cycle each.

    Parameters
    ----------
    config : Config

    Members
    -------
    base : In(address), of the hit of ray 0; constant while packets are under way
    i_begun : In(stream of begun), taken at once
    i : In(stream of {packet, number, hit}), the four of a packet in order
    o_free : Out(stream of packets), written as a whole; has to be taken at once
    port : Out(Port), writes only
    """

    base: Signal
    i_begun: stream.Interface
    i: stream.Interface
    o_free: stream.Interface
    port: PortInterface

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "base": In(config.address_bits),
            "i_begun": In(stream.Signature(begun(config), always_ready=True)),
            "i": In(stream.Signature(numbered(config, {"hit": hit(config.fmt)}))),
            "o_free": Out(stream.Signature(packet_bits(config))),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.indices = indices = memory.Memory(
            shape=self.config.address_bits, depth=self.config.packets, init=[]
        )
        writes, reads = indices.write_port(), indices.read_port()
        m.d.comb += [
            writes.en.eq(self.i_begun.valid),
            writes.addr.eq(self.i_begun.p.packet),
            writes.data.eq(self.i_begun.p.index),
        ]

        # A hit waits for a cycle, until it is known where it goes.
        request = self.port.request
        step = ~request.valid | request.ready
        waiting = Signal.like(self.i.p, reset_less=True)
        m.d.comb += [
            self.i.ready.eq(step),
            reads.en.eq(step),
            reads.addr.eq(self.i.p.packet),
            request.p.address.eq(self.base + Cat(waiting.number, reads.data)),
            request.p.write.eq(1),
            request.p.mask.eq(~0),
            request.p.data.eq(waiting.hit),
            self.o_free.valid.eq(request.valid & request.ready & (waiting.number == RAYS - 1)),
            self.o_free.payload.eq(waiting.packet),
        ]
        with m.If(step):
            m.d.sync += [request.valid.eq(self.i.valid), waiting.eq(self.i.p)]
        return m
