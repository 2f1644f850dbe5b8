"""Rays from memory."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.rays.packet import RAYS, ray_word
from hdl.rays.setup import setup_ray

WORDS = 2 * RAYS
"""Memory words of a packet's rays."""


def rays(config: Config) -> data.StructLayout:
    """Where rays lie, two words each, and how many packets of four they are."""
    return data.StructLayout({"address": config.address_bits, "packets": config.address_bits})


class Source(wiring.Component):
    """Reads rays: a ray in two cycles while the memory answers within `config.latency` cycles.

    The words of a packet are asked for together, when there is room for all of them.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of rays), taken the cycle after the last ray; at once where there is none
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
        # Words asked for ahead, and those that wait to be a packet.
        self.depth = -(-(config.latency + 8) // 2) * 2 + WORDS - 1
        super().__init__({
            "i": In(stream.Signature(rays(config))),
            "o": Out(stream.Signature(setup_ray(config))),
            "gives": Out(1),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        m.submodules.words = words = fifo.SyncFIFO(width=len(response.payload), depth=self.depth)
        asked = Signal(range((1 << self.config.address_bits) * WORDS))
        room = Signal(range(self.depth + 1), init=self.depth)
        asks = request.valid & request.ready
        m.d.comb += [
            request.valid.eq(
                self.i.valid
                & (asked != self.i.p.packets * WORDS)
                & (asked[: exact_log2(WORDS)].any() | (room >= WORDS))
            ),
            request.p.address.eq(self.i.p.address + asked),
            words.w_en.eq(response.valid),
            words.w_data.eq(response.payload),
            response.ready.eq(1),
        ]
        m.d.sync += [asked.eq(asked + asks), room.eq(room - asks + words.r_en)]

        # Two words are a ray, four rays a packet.
        fmt = self.config.fmt
        half = data.View(ray_word(fmt), words.r_data[: ray_word(fmt).size])
        origin = Signal.like(half)
        second = Signal()
        number = Signal(range(RAYS))
        given = self.o.valid & self.o.ready
        m.d.comb += [
            self.gives.eq(given & (number == RAYS - 1)),
            self.o.valid.eq(words.r_rdy & second),
            self.o.p.number.eq(number),
            self.o.p.ray.origin.eq(origin.point),
            self.o.p.ray.t_min.eq(origin.t),
            self.o.p.ray.direction.eq(half.point),
            self.o.p.ray.t_max.eq(half.t),
            words.r_en.eq(words.r_rdy & (~second | given)),
        ]
        with m.If(words.r_en):
            m.d.sync += second.eq(~second)
            with m.If(~second):
                m.d.sync += origin.eq(half)

        done = Signal.like(self.i.p.packets)
        m.d.comb += self.i.ready.eq(done == self.i.p.packets)
        m.d.sync += [number.eq(number + given), done.eq(done + self.gives)]
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += [asked.eq(0), done.eq(0)]
        return m
