"""The sum of two floats."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import bits_for

from hdl.fp.format import FloatFormat, Rounding
from hdl.fp.round import Round


class Add(wiring.Component):
    """a + b, rounded once. Takes `latency` cycles; one sum a cycle.

    ============ ============ =================================
    a            b            sum
    ============ ============ =================================
    infinity     finite       a
    infinity     the same     a
    infinity     -a           NEAREST +0, DOWN -inf, UP +inf
    finite       -a           +0; DOWN -0
    +0           -0           +0; DOWN -0
    zero         the same     a
    ============ ============ =================================

    and so with a and b exchanged. To subtract, flip the sign of b.

    Parameters
    ----------
    fmt : FloatFormat
        Format of a and b.
    rounding : Rounding
    to : FloatFormat
        Format of the sum: of the exponents of `fmt`, and of no more mantissa bits. Default: `fmt`.

    Members
    -------
    i : In(stream of {a, b: fmt})
    o : Out(stream of `to`), in the order of the inputs
    overflow : Out(1), beside o: a and b were finite and their sum is not

    Raises
    ------
    ValueError
        `to` does not go with `fmt`.
    """

    latency = 5
    i: stream.Interface
    o: stream.Interface
    overflow: Signal

    def __init__(
        self,
        fmt: FloatFormat,
        rounding: Rounding = Rounding.NEAREST,
        to: FloatFormat | None = None,
    ):
        self.fmt, self.rounding, self.to = fmt, rounding, to or fmt
        if self.to.exp_bits != fmt.exp_bits or self.to.man_bits > fmt.man_bits:
            raise ValueError(f"sums of format {fmt} do not round to format {to}")
        super().__init__({
            "i": In(stream.Signature(data.StructLayout({"a": fmt.layout, "b": fmt.layout}))),
            "o": Out(stream.Signature(self.to.layout)),
            "overflow": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, to, a, b = self.fmt, self.to, self.i.p.a, self.i.p.b
        # A significand, a carry above it, and below it the two bits that rounding looks at after
        # a shift by one, and a bit that is one if any below is.
        width = fmt.man_bits + 5
        top = (1 << fmt.exp_bits) - 1

        step = ~self.o.valid | self.o.ready
        valid = Signal(self.latency - 1)
        m.d.comb += self.i.ready.eq(step)
        with m.If(step):
            m.d.sync += Cat(valid, self.o.valid).eq(Cat(self.i.valid, valid))

        about = {"sign": 1, "zero_sign": 1, "infinite": 1, "zero": 1, "exp": fmt.exp_bits}

        # stage 1: larger and smaller
        s1 = Signal(
            data.StructLayout({
                "about": data.StructLayout(about),
                "subtract": 1,
                "distance": fmt.exp_bits,
                "large": fmt.man_bits,
                "small": fmt.man_bits + 1,
            }),
            reset_less=True,
        )
        less = Cat(a.man, a.exp) < Cat(b.man, b.exp)
        zero_a, zero_b = a.exp == 0, b.exp == 0
        infinite_a, infinite_b = a.exp == top, b.exp == top
        any_value = infinite_a & infinite_b & (a.sign ^ b.sign)
        zero_sign = a.sign | b.sign if self.rounding == Rounding.DOWN else a.sign & b.sign
        with m.If(step):
            m.d.sync += [
                s1.about.sign.eq(Mux(any_value, zero_sign, Mux(less, b.sign, a.sign))),
                s1.about.zero_sign.eq(zero_sign),
                s1.about.infinite.eq(infinite_a | infinite_b),
                s1.about.zero.eq(zero_a & zero_b),
                s1.about.exp.eq(Mux(less, b.exp, a.exp)),
                s1.subtract.eq(a.sign ^ b.sign),
                s1.distance.eq(Mux(less, b.exp - a.exp, a.exp - b.exp)),
                s1.large.eq(Mux(less, b.man, a.man)),
                s1.small.eq(Mux(zero_a | zero_b, 0, Cat(Mux(less, a.man, b.man), 1))),
            ]
            if self.rounding == Rounding.NEAREST:
                with m.If(any_value):
                    m.d.sync += [s1.about.infinite.eq(0), s1.about.zero.eq(1)]

        # stage 2: align
        s2 = Signal(
            data.StructLayout({
                "about": data.StructLayout(about),
                "large": fmt.man_bits,
                "small": width,
                "jam": 1,
                "carry": 1,
            }),
            reset_less=True,
        )
        small = Cat(C(0, 2), s1.small)
        shifts = bits_for(len(small))
        far, jam = Signal(), Signal()
        lost = [far & s1.small[-1]]
        for k in reversed(range(min(shifts, fmt.exp_bits))):
            lost.append(s1.distance[k] & small[: 1 << k].any())
            shifted = Signal(width - 2, name=f"shifted{k}")
            m.d.comb += shifted.eq(Mux(s1.distance[k], small >> (1 << k), small))
            small = shifted
        small = Mux(far, 0, small)
        m.d.comb += [far.eq(s1.distance[shifts:].any()), jam.eq(Cat(lost).any())]
        with m.If(step):
            m.d.sync += [
                s2.about.eq(s1.about),
                s2.large.eq(s1.large),
                s2.small.eq(small ^ s1.subtract.replicate(width)),
                s2.jam.eq(jam),
                s2.carry.eq(s1.subtract & ~jam),  # of minus the jam a jam stays
            ]

        # stage 3: add, count leading zeros
        s3 = Signal(
            data.StructLayout({
                "about": data.StructLayout(about),
                "total": width,
                "zeros": range(width),
            }),
            reset_less=True,
        )
        chain, total = Signal(width), Signal(width)
        m.d.comb += [
            chain.eq(Cat(s2.carry, C(0, 2), s2.large, C(1, 2)) + Cat(s2.carry, s2.small)),
            total.eq(Cat(s2.jam, chain[1:])),
        ]
        with m.If(step):
            m.d.sync += [
                s3.about.eq(s2.about),
                s3.total.eq(total),
                s3.zeros.eq(leading_zeros(total)),
                s3.about.zero.eq(s2.about.zero | ~total.any()),
            ]

        # stage 4: normalise
        m.submodules.round = rounder = Round(to, self.rounding, range(-width, top + 2))
        s4 = Signal(rounder.raw, reset_less=True)
        normal = Signal(width)
        m.d.comb += normal.eq(s3.total << s3.zeros)
        rest = width - 2 - to.man_bits
        with m.If(step):
            m.d.sync += [
                s4.sign.eq(
                    Mux(s3.about.zero & ~s3.about.infinite, s3.about.zero_sign, s3.about.sign)
                ),
                s4.infinite.eq(s3.about.infinite),
                s4.zero.eq(s3.about.zero),
                s4.exp.eq(s3.about.exp + 1 - s3.zeros),
                Cat(s4.half, s4.man).eq(normal[rest:-1]),
                s4.rest.eq(normal[:rest].any()),
            ]

        # stage 5: round
        m.d.comb += rounder.i.eq(s4)
        with m.If(step):
            m.d.sync += [self.o.p.eq(rounder.o), self.overflow.eq(rounder.overflow)]
        return m


def leading_zeros(x: Value) -> Value:
    """Number of zeros above the highest one of a value that is not zero."""
    if len(x) == 1:
        return C(0, 0)
    half = 1 << (bits_for(len(x) - 1) - 1)
    if len(x) < 2 * half:  # what is below the value does not count
        return leading_zeros(Cat(C(-1, 2 * half - len(x)), x))
    low, high = x[:half], x[half:]
    return Mux(high.any(), Cat(leading_zeros(high), C(0, 1)), Cat(leading_zeros(low), C(1, 1)))
