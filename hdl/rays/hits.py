"""The hit records of all packets."""

from collections.abc import Iterable

from amaranth import *
from amaranth.lib import data, fifo, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.fp.order import less
from hdl.isa import NODE_BITS
from hdl.rays.packet import RAYS, hit, numbered, packet_bits
from hdl.rays.stack import tested


def found(config: Config) -> data.StructLayout:
    """What a ray found at a triangle: whether it hits, and where.

    first, last : of the rays of a packet that are tested; they follow each other
    """
    numbers = dict.fromkeys(("t_min", "t", "u", "v"), config.fmt.layout)
    flags = dict.fromkeys(("first", "last", "hit"), 1)
    return numbered(config, {**flags, **surface(config), **numbers})


def surface(config: Config) -> dict[str, int]:
    """What a ray hits, the lowest first: a triangle, and the instance that it is in."""
    names = ("triangle", "instance") if config.instances else ("triangle",)
    return dict.fromkeys(names, config.pointer_bits)


class Hits(wiring.Component):
    """Keeps the first hit of each ray, and gives the hits of packets that are done.

    A hit counts if t_min <= t and t is less than the best t so far or, if equal, the triangle is;
    where there are instances that in the lower instance, and one in none after all of these.
    One a cycle; an answer takes `latency` cycles. The hits of a packet take 9 cycles. Where units
    take turns, a ray comes in three cycles, and an answer may wait one cycle for the next one: it
    is read again, not kept on its way.

    Parameters
    ----------
    config : Config

    Members
    -------
    i_rays : In(stream of {packet, number, t_max}), the ray has no hit yet
    i : In(stream of found), taken at once
    o_tests : Out(stream of tested), after the last ray
    i_done : In(stream of packets)
    o_hits : Out(stream of {packet, number, hit}), four a packet, in order

    Attributes
    ----------
    latency : int
    """

    i_rays: stream.Interface
    i: stream.Interface
    o_tests: stream.Interface
    i_done: stream.Interface
    o_hits: stream.Interface

    def __init__(self, config: Config):
        self.config = config
        fmt = config.fmt
        self.latency = self.latency_of(config)
        self.best = data.StructLayout({"t": fmt.layout, **surface(config)})
        self.weights = data.StructLayout({"u": fmt.layout, "v": fmt.layout})
        super().__init__({
            "i_rays": In(stream.Signature(numbered(config, {"t_max": fmt.layout}))),
            "i": In(stream.Signature(found(config), always_ready=True)),
            "o_tests": Out(stream.Signature(tested(config))),
            "i_done": In(stream.Signature(packet_bits(config))),
            "o_hits": Out(stream.Signature(numbered(config, {"hit": hit(config)}))),
        })

    @staticmethod
    def latency_of(config: Config) -> int:
        """The latency of Hits."""
        return 5 if config.folded else 3

    def elaborate(self, platform):
        m = Module()

        packets, folded = self.config.packets, self.config.folded
        none = (1 << self.config.pointer_bits) - 1  # above all triangles
        bests = data.ArrayLayout(self.best, RAYS)
        m.submodules.best = best_rows = memory.Memory(shape=bests, depth=packets, init=[])
        m.submodules.weights = weight_rows = memory.Memory(
            shape=self.weights, depth=RAYS * packets, init=[]
        )
        best, write = best_rows.read_port(), best_rows.write_port(granularity=1)
        weights, write_weights = weight_rows.read_port(), weight_rows.write_port()

        # stage 1: read what is best so far
        s1, s1_valid = Signal(found(self.config), reset_less=True), Signal()
        asks, asked = Signal(), Signal.like(self.i_done.p)  # for an answer
        other = Mux(asks, asked, self.i_done.p) if folded else self.i_done.p
        m.d.comb += best.addr.eq(Mux(self.i.valid, self.i.p.packet, other))
        m.d.sync += [s1.eq(self.i.p), s1_valid.eq(self.i.valid)]

        # stage 2: compare
        s2, s2_valid, better = Signal(found(self.config), reset_less=True), Signal(), Signal()
        old = Signal(self.best)
        m.d.comb += old.eq(best.data[s1.number])
        names = surface(self.config)
        tie = (s1.t.as_value() == old.t.as_value()) & (_joined(s1, names) < _joined(old, names))
        m.d.sync += [
            s2.eq(s1),
            s2_valid.eq(s1_valid),
            better.eq(s1_valid & s1.hit & ~less(s1.t, s1.t_min) & (less(s1.t, old.t) | tie)),
        ]

        # stage 3: update
        ends = s2_valid & s2.last
        if folded:
            self._answer_rows(m, ends, s2.packet, asks, asked, best.data)
        else:
            ts, new_ts = self._answer_numbers(m, ends, s2.packet)
            m.d.comb += new_ts.eq(ts)
            with m.If(better):
                m.d.comb += new_ts[s2.number].eq(s2.t)
            with m.If(s1_valid & s1.first):  # what is in stage 3 was the last of another packet
                m.d.sync += [ts[k].eq(best.data[k].t) for k in range(RAYS)]
        ray = self.i_rays
        lane = Mux(better, s2.number, ray.p.number)
        m.d.comb += [
            ray.ready.eq(~better),
            write.en.eq(Cat((better | ray.valid) & (lane == k) for k in range(RAYS))),
            write.addr.eq(Mux(better, s2.packet, ray.p.packet)),
            write_weights.en.eq(better),
            write_weights.addr.eq(Cat(s2.number, s2.packet)),
            write_weights.data.u.eq(s2.u),
            write_weights.data.v.eq(s2.v),
        ]
        for new in write.data:
            m.d.comb += [
                new.t.eq(Mux(better, s2.t, ray.p.t_max)),
                *(new[name].eq(Mux(better, s2[name], none)) for name in names),
            ]

        # A packet is done: read its row when no test does, then give its hits.
        row, out = Signal(bests, reset_less=True), self.o_hits.p
        of = Signal(self.best)
        m.d.comb += [
            weights.addr.eq(Cat(out.number, out.packet)),
            of.eq(row[out.number]),
            out.hit.t.eq(of.t),
        ]
        missed = of.triangle == none
        upper = NODE_BITS - self.config.pointer_bits
        m.d.comb += [
            *(
                out.hit[name].eq(Cat(of[name], (of[name] == none).replicate(upper)))
                for name in names
            ),
            out.hit.u.eq(Mux(missed, 0, weights.data.u)),
            out.hit.v.eq(Mux(missed, 0, weights.data.v)),
        ]
        number, packet = Signal.like(out.number), Signal.like(out.packet)
        m.d.comb += [out.number.eq(number), out.packet.eq(packet)]
        busy, first, again = Signal(), Signal(), Signal()  # a word has been asked for
        taken = self.i_done.valid & self.i_done.ready
        given = self.o_hits.valid & self.o_hits.ready
        last = number == RAYS - 1
        free = ~self.i.valid & ~asks if folded else ~self.i.valid
        m.d.comb += self.i_done.ready.eq(~busy & free)
        m.d.sync += [first.eq(taken), again.eq(given & ~last)]
        with m.If(taken):
            m.d.sync += [packet.eq(self.i_done.p), busy.eq(1)]
        with m.If(first):
            m.d.sync += row.eq(best.data)
        with m.If(first | again):
            m.d.sync += self.o_hits.valid.eq(1)
        with m.If(given):
            m.d.sync += [self.o_hits.valid.eq(0), number.eq(number + 1), busy.eq(~last)]
        return m

    def _answer_numbers(self, m: Module, ends: Value, packet: Value) -> tuple[data.View, data.View]:
        """Answers wait with their numbers. Returns those of the packet in stage 3, and new ones."""
        every_t = data.ArrayLayout(self.config.fmt.layout, RAYS)
        ts, new_ts = Signal(every_t, reset_less=True), Signal(every_t)
        m.submodules.answers = answers = fifo.SyncFIFO(
            width=len(self.o_tests.p.as_value()), depth=self.config.packets
        )
        m.d.comb += [
            answers.w_en.eq(ends),
            answers.w_data.eq(Cat(packet, new_ts)),
            self.o_tests.valid.eq(answers.r_rdy),
            self.o_tests.p.eq(answers.r_data),
            answers.r_en.eq(self.o_tests.ready),
        ]
        m.d.sync += ts.eq(new_ts)
        return ts, new_ts

    def _answer_rows(
        self, m: Module, ends: Value, packet: Value, asks: Signal, asked: Signal, row: data.View
    ):
        """Packets wait for their answers, which are their rows, read when no test reads."""
        o, comes = self.o_tests, Signal()
        m.submodules.answers = answers = fifo.SyncFIFO(width=len(packet), depth=self.config.packets)
        m.d.comb += [
            answers.w_en.eq(ends),
            answers.w_data.eq(packet),
            asked.eq(answers.r_data),
            asks.eq(answers.r_rdy & ~self.i.valid & ~comes & (~o.valid | o.ready)),
            answers.r_en.eq(asks),
        ]
        m.d.sync += comes.eq(asks)
        with m.If(o.ready):
            m.d.sync += o.valid.eq(0)
        with m.If(asks):
            m.d.sync += o.p.packet.eq(asked)
        with m.If(comes):
            m.d.sync += [o.valid.eq(1), *(o.p.t[k].eq(row[k].t) for k in range(RAYS))]


def _joined(view: data.View, names: Iterable[str]) -> Value:
    """Fields as one number, the lowest first."""
    return Cat(view[name] for name in names)
