"""What of a ray is computed once, before it meets a node."""

from collections.abc import Sequence

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.fp.add import Add
from hdl.fp.format import FloatFormat, Rounding
from hdl.fp.mul import Mul
from hdl.fp.recip import Recip, RecipBounds
from hdl.rays import step
from hdl.rays.delay import Pipeline
from hdl.rays.packet import AXES, MARGIN_ULPS, RAYS, ray, slab_ray
from hdl.rays.stack import packet_bits, start
from hdl.rays.tester import tester_ray
from hdl.stream import Landing


def setup_ray(config: Config) -> data.StructLayout:
    """A ray, and its number in its packet."""
    return data.StructLayout({"number": range(RAYS), "ray": ray(config.fmt)})


class Setup(wiring.Component):
    """Prepares the rays of packets for planes and triangles: a ray a cycle, a packet in 5.

    A packet starts when all else that is known of it has been taken, `latency` cycles after its
    last ray if nothing waits. It has no number before: rays wait here, prepared, until one is free.

    - margin = MARGIN_ULPS half ulps of 1 + the largest |origin|, rounded up twice
    - above, below: origin + margin up, origin - margin down
    - inverses of the direction, down and up
    - z of the sheared space is the axis of the largest |direction|, the first of equal ones
    - shear: z the inverse down, x and y the direction times that, to nearest

    2 multipliers (that of the margin is by a power of two), 7 adders, 3 reciprocals.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of setup_ray), the four of a packet follow each other, in order
    i_packets : In(stream of packets) that are free, taken with the last ray
    o_slabs : Out(stream of step.setup), three a packet
    o_rays : Out(stream of tester_ray), four a packet
    o_starts : Out(stream of start)
    """

    i: stream.Interface
    i_packets: stream.Interface
    o_slabs: stream.Interface
    o_rays: stream.Interface
    o_starts: stream.Interface

    def __init__(self, config: Config):
        self.config = config
        margin = 1 + Add.latency + Mul.latency
        self.last = max(margin + Add.latency, Recip.latency_of(config.fmt) + 1 + Mul.latency)
        self.room = self.last + Landing.latency + 2
        self.latency = self.last + Landing.latency + 4
        super().__init__({
            "i": In(stream.Signature(setup_ray(config))),
            "i_packets": In(stream.Signature(packet_bits(config))),
            "o_slabs": Out(stream.Signature(step.setup(config))),
            "o_rays": Out(stream.Signature(tester_ray(config))),
            "o_starts": Out(stream.Signature(start(config))),
        })

    def elaborate(self, platform):
        m = Module()

        # Nothing waits in the pipeline: it has more registers than one signal can stop in a cycle.
        p = Pipeline()
        m.submodules.pipeline = p.m
        prepared = self._pipeline(p)
        shapes = {name: value.shape() for name, value in prepared.items()}
        m.submodules.landed = landed = Landing(data.StructLayout(shapes), self.room)
        valid = Signal(self.last)
        m.d.sync += valid.eq(Cat(landed.enters, valid))
        m.d.comb += [
            self.i.ready.eq(landed.room),
            landed.enters.eq(self.i.valid & landed.room),
            landed.i.valid.eq(valid[-1]),
            *(landed.i.p[name].eq(value) for name, value in prepared.items()),
        ]

        # A ray goes to the tester as it is. Its slabs wait for those of its packet, in two places
        # in turn, so that those of a packet go while those of the next one come.
        packets, out, slabs, starts = self.i_packets, self.o_rays, self.o_slabs, self.o_starts
        ray, ready = landed.o.p, landed.o.valid
        number, ends = ray.number, ray.number == RAYS - 1
        take, place, going = Signal(), Signal(), Signal()  # going: slabs, then the start
        intervals = Signal.like(starts.p.intervals, reset_less=True)
        axis = Signal(range(3))
        lanes = data.ArrayLayout(slab_ray(self.config.fmt), RAYS)
        rows = []
        for a in AXES:
            kept = memory.Memory(shape=lanes, depth=2, init=[])
            m.submodules[f"slabs_{a}"] = kept
            write, read = kept.write_port(granularity=1), kept.read_port(domain="comb")
            m.d.comb += [
                write.en.eq(Cat(take & (number == k) for k in range(RAYS))),
                write.addr.eq(place),
                read.addr.eq(~place),
                *(lane[f].eq(ray[f"{f}_{a}"]) for lane in write.data for f, _ in lane.shape()),
            ]
            rows.append(read.data.as_value())
        m.d.comb += [
            take.eq(ready & packets.valid & (~out.valid | out.ready) & ~(ends & going)),
            landed.o.ready.eq(take),
            packets.ready.eq(take & ends),
            slabs.p.axis.eq(axis),
            slabs.p.rays.eq(Array(rows)[axis]),
            slabs.p.packet.eq(starts.p.packet),
        ]
        with m.If(out.ready):
            m.d.sync += out.valid.eq(0)
        with m.If(take):
            m.d.sync += [
                out.valid.eq(1),
                out.p.packet.eq(packets.p),
                out.p.number.eq(number),
                out.p.t_max.eq(ray.t_max),
                out.p.ray.t_min.eq(ray.t_min),
                out.p.ray.axis.eq(ray.z),
                *(out.p.ray.origin[a].eq(ray[f"origin_{a}"]) for a in AXES),
                *(out.p.ray.shear[a].eq(ray[f"shear_{a}"]) for a in AXES),
                intervals[number].near.eq(ray.t_min),
                intervals[number].far.eq(ray.t_max),
            ]

        # A packet is complete: its slabs go, then it starts, when the tester has its last ray.
        here = out.valid & (out.p.number == RAYS - 1)
        m.d.comb += starts.valid.eq(going & ~slabs.valid & ~here)
        with m.If(slabs.valid & slabs.ready):
            m.d.sync += axis.eq(Mux(axis == 2, 0, axis + 1))
            with m.If(axis == 2):
                m.d.sync += slabs.valid.eq(0)
        with m.If(starts.valid & starts.ready):
            m.d.sync += going.eq(0)
        with m.If(take & ends):
            last = starts.p.intervals[RAYS - 1]
            m.d.sync += [
                place.eq(~place),
                going.eq(1),
                slabs.valid.eq(1),
                starts.p.packet.eq(packets.p),
                starts.p.intervals.eq(intervals),
                last.near.eq(ray.t_min),
                last.far.eq(ray.t_max),
            ]
        return m

    def _pipeline(self, p: Pipeline) -> dict:
        """What there is of a ray in its last stage, by name."""
        fmt, i = self.config.fmt, self.i.p
        mask = (1 << (fmt.bits - 1)) - 1
        found = {name: p.input(name, i.ray[name]) for name in ("t_min", "t_max")}
        found["number"] = p.input("number", i.number)
        found |= {f"origin_{a}": p.input(f"origin_{a}", i.ray.origin[a]) for a in AXES}
        directions = [p.input(f"direction_{a}", i.ray.direction[a]) for a in AXES]

        # stage 1: the largest of the origin and of the direction
        largest = pick(largest_axis(i.ray.origin), [i.ray.origin[a] for a in AXES])
        largest = p.stage(p.input("largest", largest.as_value() & mask))
        found["z"] = z = p.stage(p.input("z", largest_axis(i.ray.direction)))

        margin = scale(fmt, MARGIN_ULPS.bit_length() - 1 - (fmt.man_bits + 1))
        one, factor = p.steady("one", scale(fmt, 0)), p.steady("factor", margin)
        reach = p.unit("reach", Add(fmt, Rounding.UP), largest, one)
        margin = p.unit("margin", Mul(fmt, Rounding.UP), reach, factor)
        minus = p.apply("minus_margin", lambda x: x.as_value() | (1 << (fmt.bits - 1)), margin)
        for a, direction in zip(AXES, directions, strict=True):
            origin = found[f"origin_{a}"]
            inverse = p.unit(f"inverse_{a}", RecipBounds(fmt), direction)
            found |= {
                f"above_{a}": p.unit(f"above_{a}", Add(fmt, Rounding.UP), origin, margin),
                f"below_{a}": p.unit(f"below_{a}", Add(fmt, Rounding.DOWN), origin, minus),
                f"inverse_down_{a}": p.apply(f"down_{a}", lambda x: x.down, inverse),
                f"inverse_up_{a}": p.apply(f"up_{a}", lambda x: x.up, inverse),
                f"negative_{a}": p.apply(f"negative_{a}", lambda x: x.sign, direction),
            }

        # after the inverses: the shear
        def along(name, axes, z):
            """Of three values that of axis z, behind a register."""
            return p.stage(p.apply(name, lambda z, *x: pick(z, x), z, *axes))

        inverses = [found[f"inverse_down_{a}"] for a in AXES]
        found["shear_z"] = shear = along("shear_z", inverses, z)
        for k, a in enumerate("xy"):
            turned = [directions[(axis + k + 1) % 3] for axis in range(3)]
            found[f"shear_{a}"] = p.unit(
                f"shear_{a}", Mul(fmt), along(f"turned_{a}", turned, z), shear
            )
        return {name: p.at(x, self.last) for name, x in found.items()}


def scale(fmt: FloatFormat, exponent: int) -> data.Const:
    """The pattern of a power of two: infinity or zero where out of range."""
    top = (1 << fmt.exp_bits) - 1
    return fmt.layout.const({"exp": min(max(exponent + fmt.bias, 0), top)})


def largest_axis(v: data.View) -> Value:
    """The axis of the largest magnitude, the first of equal ones."""
    x, y, z = (Cat(v[a].man, v[a].exp) for a in AXES)
    return Mux(y > x, Mux(z > y, 2, 1), Mux(z > x, 2, 0))


def pick(axis: Value, values: Sequence[data.View]) -> data.View:
    """Of three floats that of an axis."""
    return data.View(values[0].shape(), Array(x.as_value() for x in values)[axis])
