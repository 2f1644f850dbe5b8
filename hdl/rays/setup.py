"""What of a ray is computed once, before it meets a node."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.fp.add import Add
from hdl.fp.format import Rounding, power_of_two
from hdl.fp.mul import Mul
from hdl.fp.recip import Recip, RecipBounds
from hdl.rays import step
from hdl.rays.axes import pick, turn, vector
from hdl.rays.delay import Pipeline, Timed
from hdl.rays.packet import AXES, RAYS, level, numbered, packet_bits, ray, ray_word
from hdl.rays.stack import start
from hdl.rays.tester import tester_ray
from hdl.stream import Landing


def setup_ray(config: Config) -> data.StructLayout:
    """A ray, and its number in its packet."""
    return data.StructLayout({"number": range(RAYS), "ray": ray(config.fmt)})


def object_ray(config: Config) -> data.StructLayout:
    """A ray of a packet that enters an object, in the object's frame."""
    return numbered(config, {"ray": ray(config.fmt)})


def world_ray(config: Config) -> data.StructLayout:
    """Half a ray of a packet that is to begin: its origin, or where `second` its direction."""
    return numbered(config, {"second": 1, "half": ray_word(config.fmt)})


class Setup(wiring.Component):
    """Prepares the rays of packets for planes and triangles: an axis a cycle, a ray in three.

    A packet has a number as soon as its first ray comes. It starts when all else that is known of
    it has been taken, `latency` cycles after its last ray if nothing waits.

    - margin = `margin` * (1 + the largest |origin|), rounded up twice
    - above, below: origin + margin up, origin - margin down
    - inverses of the direction, down and up
    - z of the sheared space is the axis of the largest |direction|, the first of equal ones
    - shear: z the inverse down, x and y the direction times that, to nearest

    Rays of packets that enter an object go first, but never between those of another packet. A
    packet that waits for a number does not keep them waiting.

    2 multipliers, 3 adders, a reciprocal.

    Parameters
    ----------
    config : Config

    Members
    -------
    margin : In(fmt), of the scene; constant while packets are under way
    i : In(stream of setup_ray), the four of a packet follow each other, in order
    i_packets : In(stream of packets) that are free, taken with the first ray
    i_objects : In(stream of object_ray), likewise; where there are instances
    o_worlds : Out(stream of world_ray), two for each ray of `i`; where there are instances
    o_slabs : Out(stream of step.setup), one for each axis of each ray
    o_rays : Out(stream of tester_ray), four a packet
    o_starts : Out(stream of start)
    overflow : Out(1), a number has become infinite
    """

    margin: data.View
    i: stream.Interface
    i_packets: stream.Interface
    i_objects: stream.Interface
    o_worlds: stream.Interface
    o_slabs: stream.Interface
    o_rays: stream.Interface
    o_starts: stream.Interface
    overflow: Signal

    def __init__(self, config: Config):
        self.config = config
        inverse = 1 + Recip.latency_of(config.fmt)
        # cycles from an axis of a ray to its slab, and from z to the ray
        self.slab = max(1 + 2 * Add.latency + Mul.latency, inverse)
        self.last = max(inverse + len(AXES) + Mul.latency, self.slab)
        self.latency = len(AXES) + self.last + Landing.latency + 1
        instances = {
            "i_objects": In(stream.Signature(object_ray(config))),
            "o_worlds": Out(stream.Signature(world_ray(config), always_ready=True)),
        }
        super().__init__({
            "margin": In(config.fmt.layout),
            "i": In(stream.Signature(setup_ray(config))),
            "i_packets": In(stream.Signature(packet_bits(config))),
            "o_slabs": Out(stream.Signature(step.setup(config), always_ready=True)),
            "o_rays": Out(stream.Signature(tester_ray(config))),
            "o_starts": Out(stream.Signature(start(config))),
            "overflow": Out(1),
            **(instances if config.instances else {}),
        })

    def elaborate(self, platform):
        m = Module()

        packets, out, slabs, starts = self.i_packets, self.o_rays, self.o_slabs, self.o_starts
        room = -(-(self.latency + 1) // len(AXES)) + 1
        m.submodules.landed = landed = Landing(out.p.shape(), room)

        # A ray comes, and stays for one cycle an axis. There is a place for it where it lands, and
        # a number for its packet: both are known the cycle before.
        now = Signal.like(self.i.p, reset_less=True)
        packet = Signal.like(packets.p, reset_less=True)
        busy, axis, number = Signal(), Signal(range(len(AXES))), Signal(range(RAYS))
        first, ends = number == 0, axis == len(AXES) - 1
        m.d.comb += [
            landed.enters.eq(self.i.valid & self.i.ready),
            packets.ready.eq(landed.enters & first),
        ]
        m.d.sync += [
            self.i.ready.eq(
                ~landed.enters & (~busy | (axis != 0)) & landed.room & (~first | packets.valid)
            ),
            busy.eq(landed.enters | (busy & ~ends)),
            number.eq(number + landed.enters),
        ]
        with m.If(busy):
            m.d.sync += axis.eq(Mux(ends, 0, axis + 1))
        with m.If(landed.enters):
            m.d.sync += now.eq(self.i.p)
            with m.If(first):
                m.d.sync += packet.eq(packets.p)
        in_object = {name: Signal(name="in_object") for name in level(self.config)}
        if in_object:
            self._objects(m, landed, now, packet, number, busy, axis, in_object["level"])

        # Nothing waits in the pipeline.
        p = Pipeline()
        m.submodules.pipeline = p.m
        about = {"packet": packet, "number": now.number, "axis": axis, **in_object}
        about = {name: p.input(name, value) for name, value in about.items()}
        self._pipeline(p, now.ray, about, landed.i.p)
        valid = Signal(self.last)
        m.d.sync += [
            valid.eq(Cat(busy, valid)),
            self.overflow.eq(p.overflow(self.config.fmt, [busy, *valid])),
        ]
        m.d.comb += [
            slabs.valid.eq(valid[self.slab - 1]),
            landed.i.valid.eq(valid[-1] & (p.at(about["axis"], self.last) == len(AXES) - 1)),
        ]

        # It goes to the tester. With the last ray the packet is complete: it starts before the
        # next one goes on. Its slabs have gone before.
        m.d.comb += [
            out.valid.eq(landed.o.valid & ~starts.valid),
            out.p.eq(landed.o.p),
            landed.o.ready.eq(out.ready & ~starts.valid),
        ]
        with m.If(starts.ready):
            m.d.sync += starts.valid.eq(0)
        with m.If(out.valid & out.ready):
            m.d.sync += [
                starts.valid.eq(out.p.number == RAYS - 1),
                starts.p.packet.eq(out.p.packet),
                *(starts.p[name].eq(out.p[name]) for name in in_object),
                starts.p.intervals[out.p.number].near.eq(out.p.ray.t_min),
                starts.p.intervals[out.p.number].far.eq(out.p.t_max),
            ]
        return m

    def _objects(
        self,
        m: Module,
        landed: Landing,
        now: data.View,
        packet: Signal,
        number: Signal,
        busy: Signal,
        axis: Signal,
        in_object: Signal,
    ):
        """Rays of packets that enter objects go first; those of other packets are passed on."""
        i, objects, world = self.i, self.i_objects, self.o_worlds
        takes, free, first = Signal(), Signal(), number == 0
        m.d.comb += [
            takes.eq(objects.valid & objects.ready),
            landed.enters.eq((i.valid & i.ready) | takes),
            self.i_packets.ready.eq(i.valid & i.ready & first),
            free.eq(~landed.enters & (~busy | (axis != 0)) & landed.room),
        ]
        m.d.sync += [
            i.ready.eq(free & Mux(first, self.i_packets.valid & ~objects.valid, ~in_object)),
            objects.ready.eq(free & Mux(first, objects.valid, in_object)),
        ]
        with m.If(landed.enters & first):
            m.d.sync += in_object.eq(takes)
        with m.If(takes):
            m.d.sync += [now.number.eq(objects.p.number), now.ray.eq(objects.p.ray)]
            with m.If(first):
                m.d.sync += packet.eq(objects.p.packet)

        second, half, ray = axis[0], world.p.half, now.ray
        m.d.comb += [
            world.valid.eq(busy & ~in_object & (axis != len(AXES) - 1)),
            world.p.packet.eq(packet),
            world.p.number.eq(now.number),
            world.p.second.eq(second),
            half.point.eq(Mux(second, ray.direction, ray.origin)),
            half.t.eq(Mux(second, ray.t_max, ray.t_min)),
        ]

    def _pipeline(self, p: Pipeline, ray: data.View, about: dict[str, Timed], out: data.View):
        """From a ray, an axis a cycle, to slabs, and to what the tester keeps of it."""
        fmt, slabs, axis = self.config.fmt, self.o_slabs.p, about["axis"]
        mask = (1 << (fmt.bits - 1)) - 1

        # stage 1: an axis of the ray, and the largest of its origin and of its direction
        origin, direction = (
            p.stage(p.input(name, pick(axis.value, [ray[name][a] for a in AXES])))
            for name in ("origin", "direction")
        )
        largest = pick(largest_axis(ray.origin), [ray.origin[a] for a in AXES])
        largest = p.stage(p.input("largest", largest.as_value() & mask))
        z = p.stage(p.input("z", largest_axis(ray.direction)))

        one, factor = p.steady("one", power_of_two(fmt, 0)), p.steady("factor", self.margin)
        reach = p.unit("reach", Add(fmt, Rounding.UP), largest, one)
        margin = p.unit("margin", Mul(fmt, Rounding.UP), reach, factor)
        minus = p.apply("minus_margin", lambda x: x.as_value() | (1 << (fmt.bits - 1)), margin)
        inverse = p.unit("inverse", RecipBounds(fmt), direction)
        down = p.apply("down", lambda x: x.down, inverse)
        slab = {
            "above": p.unit("above", Add(fmt, Rounding.UP), origin, margin),
            "below": p.unit("below", Add(fmt, Rounding.DOWN), origin, minus),
            "inverse_down": down,
            "inverse_up": p.apply("up", lambda x: x.up, inverse),
            "negative": p.apply("negative", lambda x: x.sign, direction),
        }
        p.m.d.comb += [
            *(slabs[name].eq(p.at(x, self.slab)) for name, x in about.items()),
            *(slabs.ray[name].eq(p.at(x, self.slab)) for name, x in slab.items()),
        ]

        # When the inverse on the last axis is there, that on z is kept: for the whole ray, until
        # that of the next one is known. Each axis waits for it.
        shear_z = Signal(fmt.layout, reset_less=True)
        chosen = pick(p.at(z, down.cycle), vector(p, fmt, down, down.cycle).values())
        on_last = p.at(axis, down.cycle) == len(AXES) - 1
        with p.m.If(on_last):
            p.m.d.sync += shear_z.eq(chosen)
        kept = Timed("shear_z", shear_z, down.cycle + len(AXES))
        product = p.unit("shear", Mul(fmt), direction, kept)

        # The ray in one piece, with its last axis.
        last = self.last
        to_z = p.at(z, last)
        origins, products = vector(p, fmt, origin, last), vector(p, fmt, product, last)
        p.m.d.comb += [
            *(out[name].eq(p.at(x, last)) for name, x in about.items() if name != "axis"),
            out.t_max.eq(p.at(p.input("t_max", ray.t_max), last)),
            out.ray.t_min.eq(p.at(p.input("t_min", ray.t_min), last)),
            out.ray.axis.eq(to_z),
            *(out.ray.origin[a].eq(origins[a]) for a in AXES),
            *(out.ray.shear[a].eq(turn(products, to_z, a)) for a in "xy"),
            out.ray.shear.z.eq(p.at(kept, last)),
        ]


def largest_axis(v: data.View) -> Value:
    """The axis of the largest magnitude, the first of equal ones."""
    x, y, z = (Cat(v[a].man, v[a].exp) for a in AXES)
    return Mux(y > x, Mux(z > y, 2, 1), Mux(z > x, 2, 0))
