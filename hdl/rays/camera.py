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
from hdl.rays.axes import pick, vector
from hdl.rays.delay import Pipeline, Timed
from hdl.rays.packet import AXES, RAYS, pixel_bits
from hdl.rays.setup import setup_ray
from hdl.stream import Landing


def image(config: Config) -> data.StructLayout:
    """What a camera sees: an image, or some rows of it.

    origin : of all rays
    corner : direction of the first pixel
    right, down : by how much directions differ from a pixel to the next
    width, height : pixels, at least 1
    top : the first row, even and less than `height`
    t_min, t_max : of all rays
    """
    vertex, pixels = records.vertex(config.fmt), pixel_bits(config.fmt)
    return data.StructLayout({
        **dict.fromkeys(("origin", "corner", "right", "down"), vertex),
        **dict.fromkeys(("width", "height", "top"), pixels),
        **dict.fromkeys(("t_min", "t_max"), config.fmt.layout),
    })


class Camera(wiring.Component):
    """Gives the rays of an image: an axis a cycle, a ray in three after `latency` cycles.

    The direction at column x, row y is (corner + x * right) + y * down, each operation rounded to
    nearest. Packets go along rows of 2 x 2 pixels, and so do the rays of a packet. Beyond the
    image t_min is +inf and t_max -inf. Rows are those of the image, wherever `top` begins. 2
    multipliers and 2 adders.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of image), taken with its last ray
    o : Out(stream of setup_ray), four a packet, in order
    gives : Out(1), in one cycle for each packet, before its last ray comes
    overflow : Out(1), a number has become infinite
    """

    last = 2 + Mul.latency + 2 * Add.latency  # cycles from an axis to its direction
    latency = 1 + len(AXES) - 1 + last + Landing.latency
    i: stream.Interface
    o: stream.Interface
    gives: Signal
    overflow: Signal

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "i": In(stream.Signature(image(config))),
            "o": Out(stream.Signature(setup_ray(config))),
            "gives": Out(1),
            "overflow": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, i, o = self.config.fmt, self.i.p, self.o
        pixel = data.StructLayout({
            "number": range(RAYS),
            "beyond": 1,
            "ends": 1,
            "direction": records.vertex(fmt),
        })
        room = -(-(self.latency + 1) // len(AXES)) + 1
        m.submodules.landed = landed = Landing(pixel, room)

        # A pixel for one cycle an axis; what is known of it late is used with its last axis.
        busy, begun, all_entered = Signal(), Signal(), Signal()
        axis = Signal(range(len(AXES)))
        number = Signal(range(RAYS))
        column, row = (Signal(len(i.width) - 1, name=name) for name in ("column", "row"))
        row_ends, image_ends, beyond = (
            Signal(name=name) for name in ("row_ends", "image_ends", "beyond")
        )
        x, y = Cat(number[0], column), Cat(number[1], row)
        done = busy & (axis == len(AXES) - 1)
        ends = (number == RAYS - 1) & row_ends & image_ends
        m.d.comb += [
            landed.enters.eq(begun & landed.room & ~all_entered & (~busy | (done & ~ends))),
            self.gives.eq(done & (number == RAYS - 1)),
        ]
        m.d.sync += [
            busy.eq(landed.enters | (busy & ~done)),
            row_ends.eq((column + 1) * 2 >= i.width),
            image_ends.eq((row + 1) * 2 >= i.height),
            beyond.eq((x >= i.width) | (y >= i.height)),
        ]
        with m.If(busy):
            m.d.sync += axis.eq(Mux(done, 0, axis + 1))
        with m.If(done):
            m.d.sync += [number.eq(number + 1), all_entered.eq(ends)]
        with m.If(~begun):
            m.d.sync += [begun.eq(self.i.valid), row.eq(i.top >> 1)]
        with m.If(self.gives):
            m.d.sync += column.eq(Mux(row_ends, 0, column + 1))
            with m.If(row_ends):
                m.d.sync += row.eq(row + 1)

        # Nothing waits in the pipeline. The image stays as it is meanwhile.
        p = Pipeline()
        m.submodules.pipeline = p.m
        axes = p.input("axis", axis)

        def along(name, cycle):
            """Of a vector of the image the coordinate whose turn it is in a cycle."""
            turn = Timed("axis", p.at(axes, cycle - 1), cycle - 1)
            steady = [p.steady(f"{name}_{a}", i[name][a]) for a in AXES]
            return p.stage(p.apply(f"{name}_axis", lambda axis, *x: pick(axis, x), turn, *steady))

        # stages 1 and 2: numbers; then a coordinate
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
        across = p.unit("across", Mul(fmt), pixel_x, along("right", pixel_x.cycle))
        downward = p.unit("downward", Mul(fmt), pixel_y, along("down", pixel_y.cycle))
        in_row = p.unit("in_row", Add(fmt), along("corner", across.cycle), across)
        direction = p.unit("direction", Add(fmt), in_row, downward)

        valid = Signal(self.last)
        m.d.sync += [
            valid.eq(Cat(busy, valid)),
            self.overflow.eq(p.overflow(fmt, [busy, *valid])),
        ]
        beside = {"number": number, "beyond": beyond, "ends": ends}
        m.d.comb += [
            landed.i.valid.eq(valid[-1] & (p.at(axes, self.last) == len(AXES) - 1)),
            *(
                landed.i.p[name].eq(p.at(p.input(name, value), self.last))
                for name, value in beside.items()
            ),
            *(
                landed.i.p.direction[a].eq(x)
                for a, x in vector(p, fmt, direction, self.last).items()
            ),
        ]

        pixel = landed.o.p
        m.d.comb += [
            o.valid.eq(landed.o.valid),
            landed.o.ready.eq(o.ready),
            o.p.number.eq(pixel.number),
            o.p.ray.origin.eq(i.origin),
            o.p.ray.direction.eq(pixel.direction),
            o.p.ray.t_min.eq(Mux(pixel.beyond, fmt.layout.const({"exp": -1}), i.t_min)),
            o.p.ray.t_max.eq(Mux(pixel.beyond, fmt.layout.const({"exp": -1, "sign": 1}), i.t_max)),
            self.i.ready.eq(o.valid & o.ready & pixel.ends),
        ]
        with m.If(self.i.ready):
            m.d.sync += [all_entered.eq(0), begun.eq(0)]
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
