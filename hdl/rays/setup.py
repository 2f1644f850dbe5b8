"""What of a ray is computed once, before it meets a node."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.fp.add import Add
from hdl.fp.format import FloatFormat, Rounding
from hdl.fp.mul import Mul
from hdl.fp.recip import STEPS, Recip
from hdl.rays import step
from hdl.rays.delay import Pipeline, Timed
from hdl.rays.hits import numbered
from hdl.rays.packet import RAYS, ray, slab_ray
from hdl.rays.stack import start
from hdl.rays.tester import tester_ray

AXES = "xyz"
MARGIN_ULPS = 32
"""Half ulps of the largest distance that boxes grow by: as sim.model.rays.setup."""


def setup_ray(config: Config) -> data.StructLayout:
    """A ray of a packet."""
    return numbered(config, {"ray": ray(config.fmt)})


class Setup(wiring.Component):
    """Prepares the rays of packets for planes and triangles, an axis of a ray a cycle.

    A packet in 16 cycles; it starts when all that is known of it has been taken, `latency` cycles
    after its last ray if nothing waits.

    - margin = MARGIN_ULPS half ulps of 1 + the largest |origin|, rounded up twice
    - above, below: origin + margin up, origin - margin down
    - inverses of the direction, down and up
    - z of the sheared space is the axis of the largest |direction|, the first of equal ones
    - shear: z the inverse down, x and y the direction times that, to nearest

    A multiplier (that of the margin is by a power of two), 3 adders, 2 reciprocals.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of setup_ray), the four of a packet follow each other, in order
    o_slabs : Out(stream of step.setup), three a packet
    o_rays : Out(stream of tester_ray), four a packet
    o_starts : Out(stream of start)
    """

    i: stream.Interface
    o_slabs: stream.Interface
    o_rays: stream.Interface
    o_starts: stream.Interface

    def __init__(self, config: Config):
        self.config = config
        recip = -(-(config.fmt.man_bits + 2) // STEPS) + 1
        self.last = Mul.latency + max(1 + 2 * Add.latency, 2 + recip)
        self.latency = self.last + 4
        super().__init__({
            "i": In(stream.Signature(setup_ray(config))),
            "o_slabs": Out(stream.Signature(step.setup(config))),
            "o_rays": Out(stream.Signature(tester_ray(config))),
            "o_starts": Out(stream.Signature(start(config))),
        })

    def elaborate(self, platform):
        m = Module()

        # A ray stays for three cycles: axis z, then x and y.
        turn, go = Signal(range(3)), Signal()
        p = Pipeline()
        m.submodules.pipeline = EnableInserter(go)(p.m)
        m.d.comb += self.i.ready.eq(go & (turn == 2))
        with m.If(go & self.i.valid):
            m.d.sync += turn.eq(Mux(turn == 2, 0, turn + 1))
        found = self._pipeline(p, turn)
        found = {name: p.at(x, self.last) for name, x in found.items()}
        valid = Signal(self.last)
        with m.If(go):
            m.d.sync += valid.eq(Cat(self.i.valid, valid))

        # What comes is put together: a ray for the tester, an axis for the planes.
        slabs = data.ArrayLayout(slab_ray(self.config.fmt), RAYS)
        m.submodules.slabs = rows = memory.Memory(shape=slabs, depth=3, init=[])
        write, read = rows.write_port(granularity=1), rows.read_port(domain="comb")
        out, axis, number = self.o_rays, Signal(range(3)), found["number"]
        take = Signal()
        m.d.comb += [
            write.en.eq(Cat(take & (number == k) for k in range(RAYS))),
            write.addr.eq(found["axis"]),
            read.addr.eq(axis),
            self.o_slabs.p.axis.eq(axis),
            self.o_slabs.p.rays.eq(read.data),
            self.o_slabs.p.packet.eq(out.p.packet),
            self.o_starts.p.packet.eq(out.p.packet),
            go.eq(~valid[-1] | take),
        ]
        for lane in write.data:
            m.d.comb += [lane[field].eq(found[field]) for field, _ in lane.shape()]
        with m.If(out.ready):
            m.d.sync += out.valid.eq(0)
        with m.If(take):
            interval = self.o_starts.p.intervals[number]
            m.d.sync += [
                out.p.packet.eq(found["packet"]),
                out.p.number.eq(number),
                out.p.t_max.eq(found["t_max"]),
                out.p.ray.t_min.eq(found["t_min"]),
                interval.near.eq(found["t_min"]),
                interval.far.eq(found["t_max"]),
            ]
            with m.Switch(found["axis"]):
                for k, name in enumerate(AXES):
                    with m.Case(k):
                        m.d.sync += out.p.ray.origin[name].eq(found["origin"])
            with m.Switch(found["turn"]):
                with m.Case(0):
                    m.d.sync += [
                        out.p.ray.axis.eq(found["axis"]),
                        out.p.ray.shear.z.eq(found["inverse_down"]),
                    ]
                with m.Case(1):
                    m.d.sync += out.p.ray.shear.x.eq(found["shear"])
                with m.Case(2):
                    m.d.sync += [out.p.ray.shear.y.eq(found["shear"]), out.valid.eq(1)]

        # A packet is complete: its axes go, then it starts.
        starting = Signal()
        m.d.comb += [
            take.eq(valid[-1] & ~self.o_slabs.valid & ~starting & (~out.valid | out.ready)),
            self.o_starts.valid.eq(starting & ~out.valid),
        ]
        with m.If(take & (number == RAYS - 1) & (found["turn"] == 2)):
            m.d.sync += self.o_slabs.valid.eq(1)
        with m.If(self.o_slabs.valid & self.o_slabs.ready):
            m.d.sync += axis.eq(Mux(axis == 2, 0, axis + 1))
            with m.If(axis == 2):
                m.d.sync += [self.o_slabs.valid.eq(0), starting.eq(1)]
        with m.If(self.o_starts.valid & self.o_starts.ready):
            m.d.sync += starting.eq(0)
        return m

    def _pipeline(self, p: Pipeline, which: Value) -> dict[str, Timed]:
        """What there is of an axis of a ray."""
        fmt, i = self.config.fmt, self.i.p
        mask = (1 << (fmt.bits - 1)) - 1
        turn = p.input("turn", which)
        found = {name: p.input(name, i[name]) for name in ("packet", "number")}
        found |= {name: p.input(name, i.ray[name]) for name in ("t_min", "t_max")}

        # stage 1: the largest of the origin and of the direction
        vectors = {name: p.input(name, i.ray[name]) for name in ("origin", "direction")}
        z = p.stage(p.apply("z", largest_axis, vectors["direction"]))
        largest = p.apply("largest_axis", largest_axis, vectors["origin"])
        largest = p.apply("largest", coordinate, vectors["origin"], largest)
        largest = p.apply("magnitude", lambda x: x.as_value() & mask, largest)
        # stage 2: the axis
        axis = p.apply("axis", lambda z, turn: (z + turn - Mux(z + turn > 2, 3, 0))[:2], z, turn)
        origin, direction = (
            p.stage(p.apply(f"{name}_axis", coordinate, v, axis)) for name, v in vectors.items()
        )

        margin = scale(fmt, MARGIN_ULPS.bit_length() - 1 - (fmt.man_bits + 1))
        one, factor = p.input("one", scale(fmt, 0)), p.input("factor", margin)
        reach = p.unit("reach", Add(fmt, Rounding.UP), p.stage(largest), one)
        margin = p.unit("margin", Mul(fmt, Rounding.UP), reach, factor)
        minus = p.apply("minus_margin", lambda x: x.as_value() | (1 << (fmt.bits - 1)), margin)
        down = p.unit("down", Recip(fmt, Rounding.DOWN), direction)

        # The inverse of z stays for x and y.
        shear_z = Signal(fmt.layout, reset_less=True)
        with p.m.If(p.at(turn, down.cycle) == 0):
            p.m.d.sync += shear_z.eq(down.value)
        shear_z = Timed("shear_z", shear_z, down.cycle)
        return found | {
            "turn": turn,
            "axis": axis,
            "origin": origin,
            "above": p.unit("above", Add(fmt, Rounding.UP), origin, margin),
            "below": p.unit("below", Add(fmt, Rounding.DOWN), origin, minus),
            "inverse_down": down,
            "inverse_up": p.unit("up", Recip(fmt, Rounding.UP), direction),
            "negative": p.apply("negative", lambda x: x.sign, direction),
            "shear": p.unit("shear", Mul(fmt), direction, shear_z),
        }


def scale(fmt: FloatFormat, exponent: int) -> data.Const:
    """The pattern of a power of two: infinity or zero where out of range."""
    top = (1 << fmt.exp_bits) - 1
    return fmt.layout.const({"exp": min(max(exponent + fmt.bias, 0), top)})


def largest_axis(v: data.View) -> Value:
    """The axis of the largest magnitude, the first of equal ones."""
    x, y, z = (Cat(v[a].man, v[a].exp) for a in AXES)
    return Mux(y > x, Mux(z > y, 2, 1), Mux(z > x, 2, 0))


def coordinate(v: data.View, axis: Value) -> data.View:
    """A vector on an axis."""
    return data.View(v.x.shape(), Array(v[a].as_value() for a in AXES)[axis])
