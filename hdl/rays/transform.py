"""The transformation unit: rays of the world into the frame of an object."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.fp.add import Add
from hdl.fp.mul import Mul
from hdl.rays.axes import pick, vector
from hdl.rays.banks import BLOCK_RAM
from hdl.rays.delay import Pipeline, Timed
from hdl.rays.packet import AXES, RAYS, numbered, packet_bits, ray
from hdl.rays.setup import entering_ray
from hdl.rays.tester import entry
from hdl.rays.triangle import not_minus_zero
from hdl.stream import Landing

VECTORS = ("origin", "direction")


class Transform(wiring.Component):
    """Gives the four rays of a packet as an instance sees them: an axis a cycle, a ray in three.

    Coordinate k of the origin is ((x_k * x + y_k * y) + z_k * z) + offset_k of row k, that of the
    direction the same with an offset of 0; each operation rounded to nearest. t stays: it counts
    directions. A packet takes 12 cycles, as in setup, which is next; its first ray comes after
    `latency` if nothing waits. (Wald, Benthin, Slusallek, "Distributed Interactive Ray Tracing of
    Dynamic Scenes", 2003.)

    6 multipliers and 5 adders. Those of the triangle test, which takes a ray each cycle, would need
    a choice of operands in front of them that costs more than these multipliers do.

    Parameters
    ----------
    config : Config

    Members
    -------
    i_world : In(stream of {packet, number, ray}), rays of the world as packets begin
    i : In(stream of entry)
    o : Out(stream of entering_ray), four a packet, in order
    overflow : Out(1), a number has become infinite
    """

    pipeline = 2 + Mul.latency + 3 * Add.latency  # cycles from an axis to its coordinates
    latency = 2 + len(AXES) - 1 + pipeline + Landing.latency
    i_world: stream.Interface
    i: stream.Interface
    o: stream.Interface
    overflow: Signal

    def __init__(self, config: Config):
        self.config = config
        world = numbered(config, {"ray": ray(config.fmt)})
        super().__init__({
            "i_world": In(stream.Signature(world, always_ready=True)),
            "i": In(stream.Signature(entry(config))),
            "o": Out(stream.Signature(entering_ray(config))),
            "overflow": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        config, o = self.config, self.o
        room = -(-(self.latency + 1) // len(AXES)) + 1
        m.submodules.landed = landed = Landing(o.p.shape(), room)
        m.submodules.world = world = memory.Memory(
            shape=ray(config.fmt), depth=RAYS << packet_bits(config), init=[], attrs=BLOCK_RAM
        )
        write, read = world.write_port(), world.read_port()

        # A packet comes, and stays until the last axis of its last ray has its turn. A ray begins
        # where there is room for it.
        here = Signal(entry(config), reset_less=True)
        number, axis = Signal(range(RAYS)), Signal(range(len(AXES)))
        there, busy = Signal(), Signal()  # a packet is, a ray has its turns
        ends = axis == len(AXES) - 1
        last = busy & ends & (number == RAYS - 1)
        m.d.comb += [
            write.en.eq(self.i_world.valid),
            write.addr.eq(Cat(self.i_world.p.number, self.i_world.p.packet)),
            write.data.eq(self.i_world.p.ray),
            read.addr.eq(Cat(number, here.packet)),
            self.i.ready.eq(~there),
            landed.enters.eq(there & landed.room & (~busy | (ends & ~last))),
        ]
        m.d.sync += busy.eq(landed.enters | (busy & ~ends))
        with m.If(~there):
            m.d.sync += [here.eq(self.i.p), there.eq(self.i.valid)]
        with m.Elif(last):
            m.d.sync += there.eq(0)
        with m.If(busy):
            m.d.sync += [axis.eq(Mux(ends, 0, axis + 1)), number.eq(number + ends)]

        # Nothing waits in the pipeline.
        p = Pipeline()
        m.submodules.pipeline = p.m
        about = {"packet": here.packet, "root": here.root, "number": number}
        about = {name: p.input(name, value) for name, value in about.items()}
        self._pipeline(p, here, axis, read.data, about, landed.i.p)
        valid = Signal(self.pipeline)
        ended = p.input("ended", ends)
        m.d.sync += [
            valid.eq(Cat(busy, valid)),
            self.overflow.eq(p.overflow(config.fmt, [busy, *valid])),
        ]
        m.d.comb += landed.i.valid.eq(valid[-1] & p.at(ended, self.pipeline))
        wiring.connect(m, landed.o, wiring.flipped(o))
        return m

    def _pipeline(
        self,
        p: Pipeline,
        here: data.View,
        axis: Signal,
        read: data.View,
        about: dict[str, Timed],
        out: data.View,
    ):
        """From an axis to its coordinates, and from three of them to a ray."""
        fmt = self.config.fmt

        # stage 1: the ray has been read; stage 2: the row of the axis has been chosen
        turn = p.stage(p.input("axis", axis))
        rows = [p.steady(f"row_{a}", here[a]) for a in AXES]
        row = p.stage(p.apply("row", lambda k, *rows: pick(k, rows), turn, *rows))
        of = Timed("ray", read, 1)
        sums = {}
        for name in VECTORS:
            products = [
                p.unit(
                    f"{name}_{a}",
                    Mul(fmt),
                    p.apply(f"{name}_row_{a}", lambda x, a=a: x[a], row),
                    p.stage(p.apply(f"{name}_of_{a}", lambda x, v=name, a=a: x[v][a], of)),
                )
                for a in AXES
            ]
            two = p.unit(f"{name}_two", Add(fmt), products[0], products[1])
            sums[name] = p.unit(f"{name}_three", Add(fmt), two, products[2])
        offset = p.apply("offset", lambda x: x.offset, row)
        origins = p.unit("origin", Add(fmt), sums["origin"], offset)
        # An offset of 0 makes +0 of -0.
        directions = p.apply("direction", not_minus_zero, sums["direction"])
        limits = p.apply("limits", lambda x: Cat(x.t_min, x.t_max), of)

        last = self.pipeline
        direction, origin = (vector(p, fmt, x, last) for x in (directions, origins))
        t_min, t_max = p.at(limits, last)[: fmt.bits], p.at(limits, last)[fmt.bits :]
        p.m.d.comb += [
            *(out[name].eq(p.at(x, last)) for name, x in about.items()),
            *(out.ray.direction[a].eq(direction[a]) for a in AXES),
            *(out.ray.origin[a].eq(origin[a]) for a in AXES),
            out.ray.t_min.eq(t_min),
            out.ray.t_max.eq(t_max),
        ]
