"""The watertight ray-triangle test."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.fp.add import Add
from hdl.fp.cross import Cross
from hdl.fp.format import FloatFormat
from hdl.fp.mul import Mul
from hdl.fp.recip import Recip
from hdl.rays.axes import turn
from hdl.rays.delay import Pipeline
from hdl.rays.packet import AXES, sheared_ray


class Intersect(wiring.Component):
    """Where a ray meets a triangle. Takes `latency` cycles; one test a cycle.

    Vertices relative to the ray's origin are sheared so that the ray runs along z. It hits if the
    three edge functions, exact for the sheared vertices, have no two opposite signs and are not
    all zero. A vertex is sheared to the same bits in every triangle, so triangles that share an
    edge agree about it. All else rounds to nearest, from the edge functions on with two exponent
    bits more. (Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", JCGT 2013; there the
    edge functions round, and fall back to double precision.)

    21 multipliers of the significand's width, 19 adders, a reciprocal.

    Parameters
    ----------
    fmt : FloatFormat

    Members
    -------
    i : In(stream of {ray: sheared_ray, v0, v1, v2: vertex}); t_min of the ray does not matter
    o : Out(stream of {hit: 1, t, u, v: fmt}), in the order of the inputs; t in directions, never
        -0, u and v the weights of v1 and v2; all zero without a hit
    overflow : Out(1), a coordinate of sheared space, or a number of a hit, has become infinite

    Attributes
    ----------
    latency : int

    Raises
    ------
    ValueError
        `fmt` has no format of differences.
    """

    i: stream.Interface
    o: stream.Interface
    overflow: Signal

    def __init__(self, fmt: FloatFormat):
        self.fmt, self.wide = fmt, fmt.difference
        super().__init__({
            "i": In(stream.Signature(self.operands(fmt))),
            "o": Out(stream.Signature(self.found(fmt))),
            "overflow": Out(1),
        })
        self.latency = self.latency_of(fmt)

    @staticmethod
    def operands(fmt: FloatFormat) -> data.StructLayout:
        """A ray and a triangle."""
        corners = dict.fromkeys(("v0", "v1", "v2"), records.vertex(fmt))
        return data.StructLayout({"ray": sheared_ray(fmt), **corners})

    @staticmethod
    def found(fmt: FloatFormat) -> data.StructLayout:
        """Whether a ray hits, and where."""
        return data.StructLayout({"hit": 1, **dict.fromkeys("tuv", fmt.layout)})

    @staticmethod
    def latency_of(fmt: FloatFormat) -> int:
        """The latency of an Intersect."""
        edges = 1 + Add.latency + Mul.latency + Add.latency + Cross.latency
        recip = Recip.latency_of(fmt.difference)
        return edges + 2 * Add.latency + max(recip, Mul.latency) + Mul.latency + 1

    def elaborate(self, platform):
        m = Module()

        fmt, wide, i = self.fmt, self.wide, self.i.p
        step = ~self.o.valid | self.o.ready
        valid = Signal(self.latency - 1)
        m.d.comb += self.i.ready.eq(step)
        with m.If(step):
            m.d.sync += Cat(valid, self.o.valid).eq(Cat(self.i.valid, valid))

        p = Pipeline()
        m.submodules.pipeline = EnableInserter(step)(p.m)

        # stage 1: turn the axes
        def turned(name, point):
            return {a: p.stage(p.input(f"{name}{a}", turn(point, i.ray.axis, a))) for a in AXES}

        minus_origin = {
            a: p.apply(f"minus_origin_{a}", negated, x)
            for a, x in turned("origin_", i.ray.origin).items()
        }
        shear = {a: p.input(f"shear_{a}", i.ray.shear[a]) for a in AXES}

        # to sheared space
        sheared = []
        for k in range(3):
            v = turned(f"v{k}", i[f"v{k}"])
            r = {a: p.unit(f"relative_{k}{a}", Add(fmt), v[a], minus_origin[a]) for a in AXES}
            s = {a: p.unit(f"s{k}{a}", Mul(fmt), shear[a], r["z"]) for a in AXES}
            for axis in "xy":
                minus = p.apply(f"minus_s{k}{axis}", negated, s[axis])
                s[axis] = p.unit(f"sheared_{k}{axis}", Add(fmt), r[axis], minus)
            sheared.append(s)

        # edge functions
        e = []
        for k in range(3):
            b, c = sheared[(k + 1) % 3], sheared[(k + 2) % 3]
            e.append(p.unit(f"edge_{k}", Cross(fmt), c["x"], b["y"], c["y"], b["x"]))
        hit = p.apply("hit", no_opposite_signs, *e)

        # the area, and the depth times the area
        area = p.unit("area_01", Add(wide), e[0], e[1])
        area = p.unit("area", Add(wide), area, e[2])
        inverse = p.unit("inverse", Recip(wide), area)
        parts = []
        for k in range(3):
            z = p.apply(f"wide_{k}z", lambda x: widen(x, fmt), sheared[k]["z"])
            parts.append(p.unit(f"depth_{k}", Mul(wide), e[k], z))
        depth = p.unit("depth_01", Add(wide), parts[0], parts[1])
        depth = p.unit("depth", Add(wide), depth, parts[2])

        # divide; last stage: narrow
        for name, x in zip("tuv", (depth, e[1], e[2]), strict=True):
            found = p.unit(f"{name}_wide", Mul(wide), x, inverse)
            found = p.apply(name, lambda x, hit: narrow(x, hit, fmt), found, hit)
            if name == "t":  # -0 is where +0 is
                found = p.apply("t_not_minus_zero", not_minus_zero, found)
            m.d.comb += self.o.p[name].eq(p.at(p.stage(found), self.latency))
        m.d.comb += self.o.p.hit.eq(p.at(hit, self.latency))

        # Wider exponents hold all between the edge functions and the numbers of a hit.
        infinite = Cat(self.o.p[name].exp.all() for name in "tuv").any()
        early, late = Signal(), Signal()
        with m.If(step):
            m.d.sync += early.eq(p.overflow(fmt, [self.i.valid, *valid]))
        m.d.sync += late.eq(self.o.valid & infinite)
        m.d.comb += self.overflow.eq(early | late)
        return m


def negated(x: data.View) -> data.View:
    """Minus a float."""
    return data.View(x.shape(), Cat(x.man, x.exp, ~x.sign))


def not_minus_zero(x: data.View) -> data.View:
    """A float, and +0 for -0."""
    return data.View(x.shape(), Cat(x.man, x.exp, x.sign & x.exp.any()))


def no_opposite_signs(*edges: data.View) -> Value:
    """Some edge function is not zero, and all such have one sign."""
    positive, negative = (Cat(e.exp.any() & (e.sign == sign) for e in edges) for sign in (0, 1))
    return positive.any() ^ negative.any()


def widen(x: data.View, fmt: FloatFormat) -> data.View:
    """A float in the format of differences: exact."""
    exponent = x.exp + Mux(x.exp.any(), fmt.difference.bias - fmt.bias, 0)
    exponent = exponent[: fmt.exp_bits + 2] | x.exp.all().replicate(fmt.exp_bits + 2)
    return data.View(fmt.difference.layout, Cat(x.man, exponent, x.sign))


def narrow(wide: data.View, hit: Value, fmt: FloatFormat) -> data.View:
    """A number in the format of differences: infinity or zero where out of range.

    Without a hit +0.
    """
    least, top = fmt.difference.bias - fmt.bias, (1 << fmt.exp_bits) - 1
    zero, infinite = wide.exp <= least, wide.exp >= least + top
    exponent = (wide.exp - least)[: fmt.exp_bits] | infinite.replicate(fmt.exp_bits)
    mantissa = wide.man & (~infinite).replicate(fmt.man_bits)
    bits = Cat(Mux(zero, 0, Cat(mantissa, exponent)), wide.sign)
    return data.View(fmt.layout, Mux(hit, bits, 0))
