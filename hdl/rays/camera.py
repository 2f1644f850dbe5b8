"""The rays of a pinhole camera, in packets of 2 x 2 pixels."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import bits_for

from hdl import records
from hdl.config import Config
from hdl.fp.add import Add
from hdl.fp.format import FloatFormat
from hdl.fp.mul import Mul
from hdl.rays.delay import Pipeline
from hdl.rays.packet import RAYS
from hdl.rays.setup import AXES, coordinate, setup_ray
from hdl.rays.stack import packet_bits


def pixel_bits(fmt: FloatFormat) -> int:
    """Bits of a column or row: of no more numbers than the format holds exactly."""
    return min(fmt.man_bits + 1, fmt.bias + 1, 16)


def image(config: Config) -> data.StructLayout:
    """What a camera sees.

    origin : of all rays
    corner : direction of the first pixel
    right, down : by how much directions differ from a pixel to the next
    width, height : pixels, at least 1
    t_min, t_max : of all rays
    """
    vertex, pixels = records.vertex(config.fmt), pixel_bits(config.fmt)
    return data.StructLayout({
        **dict.fromkeys(("origin", "corner", "right", "down"), vertex),
        **dict.fromkeys(("width", "height"), pixels),
        **dict.fromkeys(("t_min", "t_max"), config.fmt.layout),
    })


class Camera(wiring.Component):
    """Gives the rays of an image: a packet in 12 cycles.

    The direction at column x, row y is (corner + x * right) + y * down, each operation rounded to
    nearest. Packets go along rows of 2 x 2 pixels, and so do the rays of a packet. Beyond the
    image t_min is +inf and t_max -inf. The first ray takes `latency` cycles; 2 multipliers and 2
    adders.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of image), taken with its last packet
    i_packets : In(stream of packets) that are free
    o : Out(stream of setup_ray), four a packet, in order
    """

    latency = 1 + Mul.latency + 2 * Add.latency + 3
    i: stream.Interface
    i_packets: stream.Interface
    o: stream.Interface

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "i": In(stream.Signature(image(config))),
            "i_packets": In(stream.Signature(packet_bits(config))),
            "o": Out(stream.Signature(setup_ray(config))),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, i, o = self.config.fmt, self.i.p, self.o
        go, enters = Signal(), self.i.valid & self.i_packets.valid
        p = Pipeline()
        m.submodules.pipeline = EnableInserter(go)(p.m)

        # An axis of a ray a cycle.
        axis, number = Signal(range(3)), Signal(range(RAYS))
        column, row = (Signal(len(i.width) - 1, name=name) for name in ("column", "row"))
        x, y = Cat(number[0], column), Cat(number[1], row)
        packet_ends = go & enters & (axis == 2) & (number == RAYS - 1)
        row_ends, image_ends = (column + 1) * 2 >= i.width, (row + 1) * 2 >= i.height
        m.d.comb += [
            self.i_packets.ready.eq(packet_ends),
            self.i.ready.eq(packet_ends & row_ends & image_ends),
        ]
        with m.If(go & enters):
            m.d.sync += axis.eq(Mux(axis == 2, 0, axis + 1))
            with m.If(axis == 2):
                m.d.sync += number.eq(number + 1)
        with m.If(packet_ends):
            m.d.sync += column.eq(Mux(row_ends, 0, column + 1))
            with m.If(row_ends):
                m.d.sync += row.eq(Mux(image_ends, 0, row + 1))

        # stage 1: the axis, and numbers
        def on_axis(name):
            return p.stage(p.input(name, coordinate(i[name], axis)))

        along, across = (
            p.stage(p.input(name, number_of(fmt, value))) for name, value in (("x", x), ("y", y))
        )
        along = p.unit("along", Mul(fmt), along, on_axis("right"))
        across = p.unit("across", Mul(fmt), across, on_axis("down"))
        direction = p.unit("direction_x", Add(fmt), on_axis("corner"), along)
        direction = p.unit("direction", Add(fmt), direction, across)
        last = direction.cycle
        beside = {
            "packet": self.i_packets.p,
            "number": number,
            "axis": axis,
            "t_min": i.t_min,
            "t_max": i.t_max,
            "origin": coordinate(i.origin, axis),
            "beyond": (x >= i.width) | (y >= i.height),
        }
        found = {name: p.at(p.input(name, value), last) for name, value in beside.items()}

        valid = Signal(last)
        take = ~o.valid | o.ready
        m.d.comb += go.eq(~valid[-1] | take)
        with m.If(go):
            m.d.sync += valid.eq(Cat(enters, valid))

        # last stage: put a ray together
        infinity = fmt.layout.const({"exp": -1})
        with m.If(o.ready):
            m.d.sync += o.valid.eq(0)
        with m.If(take & valid[-1]):
            m.d.sync += [
                o.p.packet.eq(found["packet"]),
                o.p.number.eq(found["number"]),
                o.p.ray.t_min.eq(Mux(found["beyond"], infinity, found["t_min"])),
                o.p.ray.t_max.eq(Mux(found["beyond"], infinity, found["t_max"])),
                o.valid.eq(found["axis"] == 2),
            ]
            with m.If(found["beyond"]):
                m.d.sync += o.p.ray.t_max.sign.eq(1)
            with m.Switch(found["axis"]):
                for k, name in enumerate(AXES):
                    with m.Case(k):
                        m.d.sync += [
                            o.p.ray.origin[name].eq(found["origin"]),
                            o.p.ray.direction[name].eq(direction.value),
                        ]
        return m


def number_of(fmt: FloatFormat, x: Value) -> data.View:
    """An unsigned number as a float: exact."""
    steps = bits_for(len(x) - 1)
    normal, place = Cat(x, C(0, (1 << steps) - len(x))), []
    for k in reversed(range(steps)):
        high = normal[-1 << k :].any()
        normal = Mux(high, normal, (normal << (1 << k))[: 1 << steps])
        place.insert(0, high)
    mantissa = Cat(C(0, fmt.man_bits), normal[:-1])[-fmt.man_bits :]
    exponent = (fmt.bias + Cat(place))[: fmt.exp_bits]
    return data.View(fmt.layout, Mux(x.any(), Cat(mantissa, exponent, C(0, 1)), 0))
