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
from hdl.rays.packet import AXES, RAYS, pixel_bits
from hdl.rays.setup import setup_ray
from hdl.stream import Landing


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
    """Gives the rays of an image: one a cycle after `latency` cycles.

    The direction at column x, row y is (corner + x * right) + y * down, each operation rounded to
    nearest. Packets go along rows of 2 x 2 pixels, and so do the rays of a packet. Beyond the
    image t_min is +inf and t_max -inf. 6 multipliers and 6 adders.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of image), taken when its last ray has left the pipeline
    o : Out(stream of setup_ray), four a packet, in order
    gives : Out(1), in one cycle for each packet, before its last ray comes
    """

    depth = 2 + Mul.latency + 2 * Add.latency
    latency = depth + Landing.latency
    i: stream.Interface
    o: stream.Interface
    gives: Signal

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "i": In(stream.Signature(image(config))),
            "o": Out(stream.Signature(setup_ray(config))),
            "gives": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, i = self.config.fmt, self.i.p
        # Nothing waits in the pipeline: it has more registers than one signal can stop in a cycle.
        p = Pipeline()
        m.submodules.pipeline = p.m
        m.submodules.landed = landed = Landing(self.o.p.shape(), self.depth + Landing.latency + 2)
        wiring.connect(m, landed.o, wiring.flipped(self.o))
        o, enters = landed.i, landed.enters
        all_entered = Signal()

        number = Signal(range(RAYS))
        column, row = (Signal(len(i.width) - 1, name=name) for name in ("column", "row"))
        x, y = Cat(number[0], column), Cat(number[1], row)
        row_ends, image_ends = (column + 1) * 2 >= i.width, (row + 1) * 2 >= i.height
        ends = Signal()
        m.d.comb += [
            enters.eq(self.i.valid & ~all_entered & landed.room),
            self.gives.eq(enters & (number == RAYS - 1)),
            ends.eq((number == RAYS - 1) & row_ends & image_ends),
        ]
        with m.If(enters):
            m.d.sync += [number.eq(number + 1), all_entered.eq(ends)]
        with m.If(self.gives):
            m.d.sync += column.eq(Mux(row_ends, 0, column + 1))
            with m.If(row_ends):
                m.d.sync += row.eq(Mux(image_ends, 0, row + 1))

        # stages 1 and 2: numbers; then a coordinate each. The image stays as it is meanwhile.
        pixel_x, pixel_y = (
            p.stage(
                p.apply(
                    f"pixel_{name}",
                    lambda place, value: number_of(fmt, place, value),
                    p.stage(p.input(f"{name}_place", highest_bit(value))),
                    p.input(name, value),
                )
            )
            for name, value in (("x", x), ("y", y))
        )
        for a in AXES:
            corner, right, down = (
                p.steady(f"{name}_{a}", i[name][a]) for name in ("corner", "right", "down")
            )
            along = p.unit(f"along_{a}", Mul(fmt), pixel_x, right)
            across = p.unit(f"across_{a}", Mul(fmt), pixel_y, down)
            direction = p.unit(f"in_row_{a}", Add(fmt), corner, along)
            direction = p.unit(f"direction_{a}", Add(fmt), direction, across)
            m.d.comb += o.p.ray.direction[a].eq(p.at(direction, self.depth))

        beside = {"number": number, "beyond": (x >= i.width) | (y >= i.height), "ends": ends}
        late = {name: p.at(p.input(name, value), self.depth) for name, value in beside.items()}
        valid = Signal(self.depth - 1)
        m.d.sync += Cat(valid, o.valid).eq(Cat(enters, valid))
        m.d.comb += [
            o.p.number.eq(late["number"]),
            o.p.ray.origin.eq(i.origin),
            o.p.ray.t_min.eq(i.t_min),
            o.p.ray.t_max.eq(i.t_max),
            self.i.ready.eq(o.valid & late["ends"]),
        ]
        with m.If(late["beyond"]):
            m.d.comb += [
                o.p.ray.t_min.eq(fmt.layout.const({"exp": -1})),
                o.p.ray.t_max.eq(fmt.layout.const({"exp": -1, "sign": 1})),
            ]
        with m.If(self.i.ready):
            m.d.sync += all_entered.eq(0)
        return m


def highest_bit(x: Value) -> Value:
    """The place of the highest bit of x that is set; 0 if none is."""
    alone = [x[k] & ~x[k + 1 :].any() for k in range(len(x))]
    bits = range(bits_for(len(x) - 1))
    return Cat(Cat(one for k, one in enumerate(alone) if k >> bit & 1).any() for bit in bits)


def number_of(fmt: FloatFormat, place: Value, x: Value) -> data.View:
    """An unsigned number with its highest bit at `place` as a float: exact."""
    normal = (x << ~place)[: 1 << len(place)]  # ~place: how far it is from the top
    mantissa = Cat(C(0, fmt.man_bits), normal[:-1])[-fmt.man_bits :]
    exponent = (fmt.bias + place)[: fmt.exp_bits]
    return data.View(fmt.layout, Mux(x.any(), Cat(mantissa, exponent, C(0, 1)), 0))
