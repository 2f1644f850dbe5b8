"""Rays of packets that reach an instance, taken into the frame of its object."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.fp.add import Add
from hdl.fp.mul import Mul
from hdl.rays.corners import row
from hdl.rays.delay import Pipeline
from hdl.rays.packet import AXES, RAYS, packet_bits, ray_word
from hdl.rays.setup import object_ray, world_ray
from hdl.rays.tester import entry
from hdl.stream import Landing


class Transform(wiring.Component):
    """Multiplies the rays of a packet by the matrix of an instance: a row a cycle, a ray in six.

    Coordinate k of origin and direction is ((x * px + y * py) + z * pz) + offset of row k, each
    operation rounded to nearest; a direction has +0 for the offset. t counts directions and so
    stays as it is, but rays that do not reach the instance are not there: t_min is +inf and t_max
    -inf. A packet takes 25 cycles, and leaves while the next one comes; the first ray is there
    after `latency` cycles. 3 multipliers and 3 adders.

    Parameters
    ----------
    config : Config
        With instances.

    Members
    -------
    i_worlds : In(stream of world_ray), all of a packet before it comes; taken at once
    i : In(stream of entry), taken with its last row
    o : Out(stream of object_ray), four a packet, in order
    overflow : Out(1), a number has become infinite
    """

    last = 1 + Mul.latency + 3 * Add.latency  # cycles from a row in use to its coordinate
    latency = 6 + last + Landing.latency
    i_worlds: stream.Interface
    i: stream.Interface
    o: stream.Interface
    overflow: Signal

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "i_worlds": In(stream.Signature(world_ray(config), always_ready=True)),
            "i": In(stream.Signature(entry(config))),
            "o": Out(stream.Signature(object_ray(config))),
            "overflow": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, i, worlds = self.config.fmt, self.i, self.i_worlds
        cycles = 2 * len(AXES)  # of a ray
        room = -(-(self.latency + 1) // cycles) + 1
        m.submodules.landed = landed = Landing(object_ray(self.config), room)
        m.submodules.rays = rays = memory.Memory(
            shape=ray_word(fmt), depth=2 * RAYS << packet_bits(self.config), init=[]
        )
        write, read = rays.write_port(), rays.read_port()

        # A row a cycle: of the origin, then of the direction, of each ray. Once begun, a ray goes
        # on.
        place = data.StructLayout({"row": range(len(AXES)), "second": 1, "number": range(RAYS)})
        now, then = (Signal(place, name=name) for name in ("now", "then"))
        goes, went = Signal(), Signal()
        begins = (now.row == 0) & ~now.second
        last_row = now.row == len(AXES) - 1
        ends = then.second & (then.row == len(AXES) - 1)
        m.d.comb += [
            write.en.eq(worlds.valid),
            write.addr.eq(Cat(worlds.p.second, worlds.p.number, worlds.p.packet)),
            write.data.eq(worlds.p.half),
            goes.eq(i.valid & ~i.ready & (~begins | landed.room)),
            landed.enters.eq(goes & begins),
            read.addr.eq(Cat(now.second, now.number, i.p.packet)),
            i.ready.eq(went & ends & (then.number == RAYS - 1)),
        ]
        m.d.sync += [went.eq(goes), then.eq(now)]
        with m.If(goes):
            m.d.sync += now.row.eq(Mux(last_row, 0, now.row + 1))
            with m.If(last_row):
                m.d.sync += Cat(now.second, now.number).eq(Cat(now.second, now.number) + 1)

        # Half a ray has been read: with its row it goes. Nothing waits in the pipeline.
        p = Pipeline()
        m.submodules.pipeline = p.m
        half, rows = read.data, Array(each.as_value() for each in i.p.rows)
        of = data.View(row(fmt), rows[then.row])
        point = {a: p.stage(p.input(f"p{a}", half.point[a])) for a in AXES}
        factor = {a: p.stage(p.input(a, of[a])) for a in AXES}
        offset = data.View(fmt.layout, Mux(then.second, 0, of.offset))
        offset = p.stage(p.input("offset", offset))
        products = [p.unit(f"product_{a}", Mul(fmt), factor[a], point[a]) for a in AXES]
        total = p.unit("sum_xy", Add(fmt), *products[:2])
        total = p.unit("sum", Add(fmt), total, products[2])
        total = p.unit("coordinate", Add(fmt), total, offset)
        valid = Signal(self.last)
        m.d.sync += [
            valid.eq(Cat(went, valid)),
            self.overflow.eq(p.overflow(fmt, [went, *valid])),
        ]

        # The ray in one piece, with its last coordinate: those before it are kept.
        never = fmt.layout.const({"exp": (1 << fmt.exp_bits) - 1}).as_value() | (
            then.second << (fmt.bits - 1)
        )
        reaches = i.p.mask.bit_select(then.number, 1)
        fields = {
            "packet": i.p.packet,
            "number": then.number,
            "second": then.second,
            "ends": ends,
            "t": Mux(reaches, half.t, never),
        }
        late = {
            name: Value.cast(p.at(p.input(name, Value.cast(value)), self.last))
            for name, value in fields.items()
        }
        kept = Signal(data.ArrayLayout(fmt.layout, cycles - 1), reset_less=True)
        t_min = Signal(fmt.layout, reset_less=True)
        m.d.sync += kept.eq(Cat(kept.as_value()[fmt.bits :], p.at(total, self.last)))
        with m.If(~late["second"]):
            m.d.sync += t_min.eq(late["t"])
        out = landed.i.p
        coordinates = [part[a] for part in (out.ray.origin, out.ray.direction) for a in AXES]
        m.d.comb += [
            landed.i.valid.eq(valid[-1] & late["ends"]),
            out.packet.eq(late["packet"]),
            out.number.eq(late["number"]),
            Cat(coordinates).eq(Cat(kept, p.at(total, self.last))),
            out.ray.t_min.eq(t_min),
            out.ray.t_max.eq(late["t"]),
        ]
        wiring.connect(m, wiring.flipped(self.o), landed.o)
        return m
