"""Rays from memory, a packet number for each four of them."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.rays.packet import RAYS, ray_word
from hdl.rays.recorder import begun
from hdl.rays.setup import setup_ray
from hdl.rays.stack import packet_bits


def rays(config: Config) -> data.StructLayout:
    """Where rays lie, two words each, and how many packets of four they are."""
    return data.StructLayout({"address": config.address_bits, "packets": config.address_bits})


class Source(wiring.Component):
    """Reads rays from memory, and begins a packet for each four as packet numbers come free.

    A ray in two cycles while the memory answers within `config.latency` cycles.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of rays), taken when all of the last one have been given
    i_free : In(stream of packets), numbers that may be used again
    o : Out(stream of setup_ray)
    o_begun : Out(stream of begun), with the last ray of a packet
    port : Out(Port), reads only
    """

    i: stream.Interface
    i_free: stream.Interface
    o: stream.Interface
    o_begun: stream.Interface
    port: PortInterface

    def __init__(self, config: Config):
        self.config = config
        self.depth = -(-(config.latency + 8) // 2) * 2  # words asked for ahead
        packet = packet_bits(config)
        super().__init__({
            "i": In(stream.Signature(rays(config))),
            "i_free": In(stream.Signature(packet)),
            "o": Out(stream.Signature(setup_ray(config))),
            "o_begun": Out(stream.Signature(begun(config))),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        m.submodules.words = words = fifo.SyncFIFO(width=len(response.payload), depth=self.depth)
        address = Signal.like(request.p.address, reset_less=True)
        unread = Signal(range((1 << self.config.address_bits) * 2 * RAYS))
        left = Signal(self.config.address_bits)  # packets not begun
        room = Signal(range(self.depth + 1), init=self.depth)
        asked = request.valid & request.ready
        m.d.comb += [
            request.valid.eq((unread != 0) & (room != 0)),
            request.p.address.eq(address),
            words.w_en.eq(response.valid),
            words.w_data.eq(response.payload),
            response.ready.eq(1),
            self.i.ready.eq(left == 0),
        ]
        m.d.sync += room.eq(room - asked + words.r_en)
        with m.If(asked):
            m.d.sync += [address.eq(address + 1), unread.eq(unread - 1)]

        # Numbers of packets: all of them at first, then what comes back.
        packets = self.config.packets
        m.submodules.returned = returned = fifo.SyncFIFO(
            width=len(self.i_free.payload), depth=packets
        )
        fresh = Signal(range(packets + 1))
        packet, free, unused = Signal.like(self.i_free.payload), Signal(), Signal()
        m.d.comb += [
            returned.w_en.eq(self.i_free.valid),
            returned.w_data.eq(self.i_free.payload),
            self.i_free.ready.eq(1),  # there are no more than it holds
            unused.eq(fresh != packets),
            free.eq(unused | returned.r_rdy),
            packet.eq(Mux(unused, fresh, returned.r_data)),
        ]

        # Two words are a ray, four rays a packet.
        fmt = self.config.fmt
        half = data.View(ray_word(fmt), words.r_data[: ray_word(fmt).size])
        origin = Signal.like(half)
        second, number = Signal(), Signal(range(RAYS))
        index = Signal(self.config.address_bits)
        last = number == RAYS - 1
        given = Signal()
        m.d.comb += [
            self.o.valid.eq(words.r_rdy & second & free & (~last | self.o_begun.ready)),
            self.o.p.packet.eq(packet),
            self.o.p.number.eq(number),
            self.o.p.ray.origin.eq(origin.point),
            self.o.p.ray.t_min.eq(origin.t),
            self.o.p.ray.direction.eq(half.point),
            self.o.p.ray.t_max.eq(half.t),
            given.eq(self.o.valid & self.o.ready),
            words.r_en.eq(words.r_rdy & (~second | given)),
            self.o_begun.valid.eq(given & last),
            self.o_begun.p.packet.eq(packet),
            self.o_begun.p.index.eq(index),
        ]
        with m.If(words.r_en):
            m.d.sync += second.eq(~second)
            with m.If(~second):
                m.d.sync += origin.eq(half)
        with m.If(given):
            m.d.sync += number.eq(number + 1)
            with m.If(last):
                m.d.comb += returned.r_en.eq(~unused)
                m.d.sync += [
                    fresh.eq(fresh + unused),
                    index.eq(index + 1),
                    left.eq(left - 1),
                ]
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += [
                address.eq(self.i.p.address),
                unread.eq(self.i.p.packets * (2 * RAYS)),
                left.eq(self.i.p.packets),
                index.eq(0),
            ]
        return m
