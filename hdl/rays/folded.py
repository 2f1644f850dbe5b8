"""The watertight ray-triangle test on a third of the units."""

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.fp.add import Add
from hdl.fp.cross import Cross
from hdl.fp.folded_recip import FoldedRecip
from hdl.fp.format import FloatFormat
from hdl.fp.mul import Mul
from hdl.rays.axes import pick, turn
from hdl.rays.delay import Timed
from hdl.rays.packet import AXES
from hdl.rays.triangle import (
    Intersect,
    narrow,
    negated,
    no_opposite_signs,
    not_minus_zero,
    widen,
)
from hdl.rays.turns import TURNS, Turns


class FoldedIntersect(wiring.Component):
    """Intersect, bit for bit, but a vertex, an edge and a number a cycle: a test in three cycles.

    Takes `latency` cycles from the third of these. Turn k is that of vertex k, then of the edge
    from it to the next one, then of one of v, t and u. Turns come in order and never wait for a
    test: one begins in the next turn 0. So each unit knows by the turn what it works on, and two
    additions of three can share an adder, though one comes later than the next test.

    7 multipliers, 7 adders, a reciprocal.

    Parameters
    ----------
    fmt : FloatFormat

    Members
    -------
    i : In(stream of Intersect.operands(fmt)), which are read as they wait: the ray in all turns,
        v0, v1 and v2 each in its own; taken in turn 2
    o : Out(stream of Intersect.found(fmt)), in the order of the inputs
    overflow : Out(1), a coordinate of sheared space, or a number of a hit, has become infinite
    turn : Out, 0 to 2; whose vertex is read

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
    turn: Signal

    def __init__(self, fmt: FloatFormat):
        self.fmt, self.wide = fmt, fmt.difference
        super().__init__({
            "i": In(stream.Signature(Intersect.operands(fmt))),
            "o": Out(stream.Signature(Intersect.found(fmt))),
            "overflow": Out(1),
            "turn": Out(range(TURNS)),
        })
        self.latency = self.latency_of(fmt)

    @staticmethod
    def latency_of(fmt: FloatFormat) -> int:
        """The latency of a FoldedIntersect."""
        edges = Add.latency + 1 + Mul.latency + Add.latency + 2 + Cross.latency
        inverse = edges + 2 * Add.latency + FoldedRecip.latency_of(fmt.difference) + TURNS - 1
        return inverse + Mul.latency + 1

    def elaborate(self, platform):
        m = Module()

        fmt, wide, i = self.fmt, self.wide, self.i.p
        step = ~self.o.valid | self.o.ready
        valid = Signal(self.latency - 1)  # a test has this turn, by the cycles since
        here = Mux(self.turn == 0, self.i.valid, valid[0])
        p = Turns(self.turn)
        m.submodules.pipeline = EnableInserter(step)(p.m)
        m.d.comb += self.i.ready.eq(step & (self.turn == TURNS - 1) & valid[0])
        with m.If(step):
            m.d.sync += [
                self.turn.eq(Mux(self.turn == TURNS - 1, 0, self.turn + 1)),
                valid.eq(Cat(here, valid)),
                self.o.valid.eq(valid[-1] & p.is_turn(TURNS - 1, self.latency - 1)),
            ]

        # to sheared space, a vertex a turn
        relative = []
        for a in AXES:
            v = p.input(f"v_{a}", pick(self.turn, [i[f"v{k}"][a] for k in range(TURNS)]))
            minus_origin = p.input(f"minus_origin_{a}", negated(i.ray.origin[a]))
            relative.append(p.unit(f"relative_{a}", Add(fmt), v, minus_origin))
        axis = p.input("axis", i.ray.axis)
        r, s = {}, {}
        for a in AXES:
            r[a] = p.apply(
                f"turned_{a}",
                lambda axis, *x, a=a: turn(dict(zip(AXES, x, strict=True)), axis, a),
                axis,
                *relative,
            )
            r[a] = p.stage(r[a])
        for a in AXES:
            shear = p.of_input(f"shear_{a}", i.ray.shear[a], r["z"].cycle)
            s[a] = p.unit(f"s_{a}", Mul(fmt), shear, r["z"])
        for a in "xy":
            minus = p.apply(f"minus_s_{a}", negated, s[a])
            s[a] = p.unit(f"sheared_{a}", Add(fmt), r[a], minus)

        # edge functions, from a vertex to the next one: of edges 2, 0 and 1
        after = {
            a: p.stage(p.choose(f"after_{a}", 2, p.other(s[a], -2), p.other(s[a], 1))) for a in "xy"
        }
        e = p.unit("edge", Cross(fmt), after["x"], s["y"], after["y"], s["x"])
        hit = p.keep(p.apply("hit", no_opposite_signs, e, p.other(e, -1), p.other(e, -2)))

        # the area, and the depth times the area
        area = self._sum(p, "area", e)
        recip = FoldedRecip(wide)
        p.m.d.comb += recip.takes.eq(p.is_turn(TURNS - 1, area.cycle))
        inverse = p.unit("inverse", recip, area)
        inverse = Timed("inverse", inverse.value, inverse.cycle + TURNS - 1)  # it stays
        z = p.choose("z", 0, p.other(s["z"], 2), p.other(s["z"], -1))
        z = p.apply("wide_z", lambda x: widen(x, fmt), z)
        depth = self._sum(p, "depth", p.unit("depth_part", Mul(wide), e, z))

        # divide: v, t and u; last stage: narrow
        x = p.choose("dividend", 1, p.other(depth, 1), e)
        x = p.unit("divided", Mul(wide), x, inverse)
        hit = Timed("hit_late", p.at(hit, x.cycle), x.cycle)
        x = p.apply("narrow", lambda x, hit: narrow(x, hit, fmt), x, hit)
        x = p.stage(p.choose("number", 1, p.apply("t", not_minus_zero, x), x))
        for before, name in enumerate("utv"):
            m.d.comb += self.o.p[name].eq(p.at(p.other(x, -before), self.latency))
        m.d.comb += self.o.p.hit.eq(p.at(hit, self.latency))

        # Wider exponents hold all between the edge functions and the numbers of a hit.
        infinite = Cat(self.o.p[name].exp.all() for name in "tuv").any()
        early, late = Signal(), Signal()
        with m.If(step):
            m.d.sync += early.eq(p.overflow(fmt, [here, *valid]))
        m.d.sync += late.eq(self.o.valid & infinite)
        m.d.comb += self.overflow.eq(early | late)
        return m

    def _sum(self, p: Turns, name: str, x: Timed) -> Timed:
        """(x of turn 1 + that of turn 2) + that of turn 0: there in turn 2, by one adder.

        Both are there in turn 2. Their sum is there in a turn in which the adder is free.
        """
        two = Signal(self.wide.layout, name=f"{name}_two")
        second = (TURNS - 1 + Add.latency) % TURNS
        again = Timed(f"{name}_again", two, x.cycle)
        a = p.choose(f"{name}_a", second, again, p.other(x, -1))
        b = p.choose(f"{name}_b", second, p.other(x, 1 - TURNS - Add.latency), x)
        total = p.unit(name, Add(self.wide), a, b)
        p.m.d.comb += two.eq(total.value)
        return p.other(total, Add.latency)
