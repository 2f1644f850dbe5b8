"""Rays from memory."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.ahead import Ahead
from hdl.memory.port import Port, PortInterface
from hdl.rays.packet import RAYS, ray_word
from hdl.rays.setup import setup_ray
from hdl.stream import Slice

WORDS = 2 * RAYS
"""Memory words of a packet's rays."""


def rays(config: Config) -> data.StructLayout:
    """Where rays lie, two words each, and how many packets of four they are."""
    return data.StructLayout({"address": config.address_bits, "packets": config.address_bits})


class Source(wiring.Component):
    """Reads rays: a ray in two cycles while the memory answers within `config.latency` cycles.

    A ray leaves 2 cycles after its second word came. Words are asked for in blocks of a packet's.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of rays), taken the cycle after the last ray; a cycle after it comes where
        there is none
    o : Out(stream of setup_ray), four a packet, in order
    gives : Out(1), in one cycle for each packet
    port : Out(Port), reads only
    """

    i: stream.Interface
    o: stream.Interface
    gives: Signal
    port: PortInterface

    def __init__(self, config: Config):
        self.config = config
        # Words that the memory's latency and that of the units on the way to it ask for, and those
        # that wait to be a packet.
        self.depth = config.latency + 11 + WORDS
        super().__init__({
            "i": In(stream.Signature(rays(config))),
            "o": Out(stream.Signature(setup_ray(config))),
            "gives": Out(1),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.words = words = Ahead(self.config, depth=self.depth, block=WORDS)
        # Rays are asked for last: whether they are is known late.
        m.submodules.next_ask = next_ask = Slice(self.config.address_bits)
        m.d.comb += [
            next_ask.i.valid.eq(words.port.request.valid),
            next_ask.i.p.eq(words.port.request.p.address),
            words.port.request.ready.eq(next_ask.i.ready),
            self.port.request.valid.eq(next_ask.o.valid),
            self.port.request.p.address.eq(next_ask.o.p),
            next_ask.o.ready.eq(self.port.request.ready),
            words.port.response.valid.eq(self.port.response.valid),
            words.port.response.payload.eq(self.port.response.payload),
        ]
        begun = Signal()
        left = Signal.like(self.i.p.packets)
        some = Signal()  # left is not 0
        m.d.comb += [
            words.i.valid.eq(self.i.valid & ~begun),  # ready, since all words have been used
            words.i.p.address.eq(self.i.p.address),
            words.i.p.words.eq(self.i.p.packets * WORDS),
            self.i.ready.eq(begun & ~some),
        ]
        with m.If(self.i.ready):
            m.d.sync += begun.eq(0)
        with m.Elif(self.i.valid):
            m.d.sync += begun.eq(1)

        # Two words are a ray, four rays a packet.
        fmt = self.config.fmt
        half = data.View(ray_word(fmt), words.o.payload[: ray_word(fmt).size])
        second = Signal()
        number = Signal(range(RAYS))
        given = self.o.valid & self.o.ready
        m.d.comb += [
            words.o.ready.eq(~self.o.valid | self.o.ready),
            self.gives.eq(given & (number == RAYS - 1)),
            self.o.p.number.eq(number),
        ]
        with m.If(words.o.ready):
            m.d.sync += self.o.valid.eq(words.o.valid & second)
            with m.If(words.o.valid):
                m.d.sync += second.eq(~second)
            with m.If(second):
                m.d.sync += [self.o.p.ray.direction.eq(half.point), self.o.p.ray.t_max.eq(half.t)]
            with m.Else():
                m.d.sync += [self.o.p.ray.origin.eq(half.point), self.o.p.ray.t_min.eq(half.t)]

        m.d.sync += number.eq(number + given)
        with m.If(~begun):
            m.d.sync += [left.eq(self.i.p.packets), some.eq(self.i.p.packets != 0)]
        with m.Elif(self.gives):
            m.d.sync += [left.eq(left - 1), some.eq(left != 1)]
        return m
