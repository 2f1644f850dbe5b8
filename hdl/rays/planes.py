"""The part of a ray between the two planes of a child."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.fp.add import Add
from hdl.fp.format import FloatFormat, Rounding
from hdl.fp.mul import Mul
from hdl.rays.packet import slab_ray


class Planes(wiring.Component):
    """Where a ray enters and where it leaves a slab [low, high] on an axis, rounded outward.

    low - above down, high - below up; of these the one that the ray meets first, times the
    inverse that makes the product least, down; the other, times that which makes it greatest, up.
    Takes `latency` cycles; one slab a cycle.

    Parameters
    ----------
    fmt : FloatFormat

    Members
    -------
    i : In(stream of {low, high: fmt, ray: slab_ray})
    o : Out(stream of {begin, end: fmt}), t in directions of the ray, in the order of the inputs
    overflow : Out(1), a number on the way to an o has become infinite
    """

    latency = Add.latency + 1 + Mul.latency
    i: stream.Interface
    o: stream.Interface
    overflow: Signal

    def __init__(self, fmt: FloatFormat):
        self.fmt = fmt
        super().__init__({
            "i": In(
                stream.Signature(
                    data.StructLayout({"low": fmt.layout, "high": fmt.layout, "ray": slab_ray(fmt)})
                )
            ),
            "o": Out(stream.Signature(data.StructLayout({"begin": fmt.layout, "end": fmt.layout}))),
            "overflow": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        x = self.i.p
        m.submodules.from_low = from_low = Add(self.fmt, Rounding.DOWN)
        m.submodules.from_high = from_high = Add(self.fmt, Rounding.UP)
        m.submodules.begin = begin = Mul(self.fmt, Rounding.DOWN)
        m.submodules.end = end = Mul(self.fmt, Rounding.UP)
        step = begin.i.ready

        m.d.comb += self.i.ready.eq(from_low.i.ready)
        sums = [(from_low, x.low, x.ray.above), (from_high, x.high, x.ray.below)]
        for add, bound, origin in sums:
            m.d.comb += [
                add.i.valid.eq(self.i.valid),
                add.i.p.a.eq(bound),
                add.i.p.b.eq(origin),
                add.i.p.b.sign.eq(~origin.sign),
                add.o.ready.eq(step),
            ]

        # The ray, beside the sums.
        ray = x.ray
        for k in range(1, Add.latency + 1):
            later = Signal(slab_ray(self.fmt), name=f"ray_{k}", reset_less=True)
            with m.If(from_low.i.ready):
                m.d.sync += later.eq(ray)
            ray = later

        # the stage between: which plane is first, and the inverses
        valid = Signal()
        first = Mux(ray.negative, from_high.o.p, from_low.o.p)
        last = Mux(ray.negative, from_low.o.p, from_high.o.p)
        sign = self.fmt.bits - 1
        factors = [
            (begin, "begin", first, Mux(first[sign], ray.inverse_up, ray.inverse_down)),
            (end, "end", last, Mux(last[sign], ray.inverse_down, ray.inverse_up)),
        ]
        with m.If(step):
            m.d.sync += valid.eq(from_low.o.valid)
        for mul, name, distance, inverse in factors:
            a, b = (Signal(self.fmt.layout, name=f"{name}_{x}", reset_less=True) for x in "ab")
            with m.If(step):
                m.d.sync += [a.eq(distance), b.eq(inverse)]
            m.d.comb += [
                mul.i.valid.eq(valid),
                mul.i.p.a.eq(a),
                mul.i.p.b.eq(b),
                mul.o.ready.eq(self.o.ready),
                self.o.p[name].eq(mul.o.p),
            ]
        m.d.comb += [
            self.o.valid.eq(begin.o.valid),
            self.overflow.eq(
                (from_low.o.valid & (from_low.overflow | from_high.overflow))
                | (begin.o.valid & (begin.overflow | end.overflow))
            ),
        ]
        return m
