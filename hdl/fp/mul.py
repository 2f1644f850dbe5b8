"""The product of two floats."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.fp.format import FloatFormat, Rounding
from hdl.fp.round import Round


class Product(wiring.Component):
    """The exact product of two floats that are neither zero nor infinite; combinational.

    Parameters
    ----------
    fmt : FloatFormat
    offset : int
        Added to the sum of the biased exponents.

    Members
    -------
    a, b : In(fmt)
    sign : Out(1)
    exp : Out, of a significand from 1 to 2
    man : Out, below a hidden one; twice the bits of a mantissa, and one
    significand : Out, from 1 to 4: with two bits before the point
    """

    a: data.View
    b: data.View
    sign: Signal
    exp: Signal
    man: Signal
    significand: Signal

    def __init__(self, fmt: FloatFormat, offset: int):
        self.offset = offset
        most = (2 << fmt.exp_bits) - 1 + offset
        super().__init__({
            "a": In(fmt.layout),
            "b": In(fmt.layout),
            "sign": Out(1),
            "exp": Out(range(min(offset, 0), most + 1)),
            "man": Out(2 * fmt.man_bits + 1),
            "significand": Out(2 * fmt.man_bits + 2),
        })

    def elaborate(self, platform):
        m = Module()

        significand = self.significand
        two = significand[-1]
        exponent = Signal(len(self.a.exp) + 1)
        m.d.comb += [
            significand.eq(Cat(self.a.man, 1) * Cat(self.b.man, 1)),
            self.sign.eq(self.a.sign ^ self.b.sign),
            self.man.eq(Mux(two, significand, significand << 1)),
            # Both exponents are there before the multiplier knows which.
            exponent.eq(self.a.exp + self.b.exp),
            self.exp.eq(Mux(two, exponent + (self.offset + 1), exponent + self.offset)),
        ]
        return m


class Mul(wiring.Component):
    """a * b, rounded once. Takes `latency` cycles; one product a cycle.

    Signs multiply.

    ============ ============ =========================================
    a            b            product
    ============ ============ =========================================
    zero         finite       zero
    infinity     not zero     infinity
    zero         infinity     NEAREST zero, DOWN -inf, UP +inf
    ============ ============ =========================================

    and so with a and b exchanged.

    Parameters
    ----------
    fmt : FloatFormat
    rounding : Rounding

    Members
    -------
    i : In(stream of {a, b: fmt})
    o : Out(stream of fmt), in the order of the inputs
    overflow : Out(1), beside o: a and b were finite and their product is not
    """

    latency = 2
    i: stream.Interface
    o: stream.Interface
    overflow: Signal

    def __init__(self, fmt: FloatFormat, rounding: Rounding = Rounding.NEAREST):
        self.fmt, self.rounding = fmt, rounding
        super().__init__({
            "i": In(stream.Signature(data.StructLayout({"a": fmt.layout, "b": fmt.layout}))),
            "o": Out(stream.Signature(fmt.layout)),
            "overflow": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, rounding = self.fmt, self.rounding
        step = ~self.o.valid | self.o.ready
        valid = Signal(self.latency - 1)
        m.d.comb += self.i.ready.eq(step)

        a, b, nearest = self.i.p.a, self.i.p.b, rounding == Rounding.NEAREST
        infinite, zero = a.exp.all() | b.exp.all(), ~a.exp.any() | ~b.exp.any()
        m.submodules.product = product = Product(fmt, -fmt.bias)
        m.d.comb += [product.a.eq(a), product.b.eq(b)]
        sign = product.sign
        if not nearest:
            sign = Mux(infinite & zero, rounding == Rounding.DOWN, sign)

        m.submodules.round = rounder = Round(fmt, rounding, range(-fmt.bias, 3 * fmt.bias + 2))
        s1 = Signal(rounder.raw, reset_less=True)
        # Whether there is more below the half, of four bits each: no more gates than the rest has.
        two, low = product.significand[-1], product.significand[: fmt.man_bits]
        parts = [low[k : min(k + 4, len(low) - 1)].any() for k in range(0, len(low) - 1, 4)]
        more = Signal(len(parts) + 1, reset_less=True)
        m.d.comb += [rounder.i.eq(s1), rounder.i.rest.eq(more.any())]
        with m.If(step):
            m.d.sync += Cat(valid, self.o.valid).eq(Cat(self.i.valid, valid))
            m.d.sync += [  # stage 1: multiply, normalise
                s1.sign.eq(sign),
                s1.infinite.eq(infinite & ~zero if nearest else infinite),
                s1.zero.eq(zero),
                s1.exp.eq(product.exp),
                Cat(s1.half, s1.man).eq(product.man[fmt.man_bits :]),
                more.eq(Cat(*parts, two & low[-1])),
            ]
            m.d.sync += [  # stage 2: round
                self.o.p.eq(rounder.o),
                self.overflow.eq(rounder.overflow),
            ]
        return m
