"""The one place that rounds: what an operation found, to a bit pattern."""

from amaranth import *
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from hdl.fp.format import FloatFormat, Rounding


class Round(wiring.Component):
    """Bit pattern of a result; combinational: a carry chain and few gates around it.

    Parameters
    ----------
    fmt : FloatFormat
    rounding : Rounding
    exponents : range
        Of biased exponents that can come, as if exponents had no end.

    Members
    -------
    i : In, of these fields
        sign;
        infinite, zero: nothing else counts but the sign, infinite before zero;
        exp: biased; man: below a hidden one;
        half, rest: the next bit of the significand, and whether there is more
    o : Out(fmt)
    overflow : Out(1), it was finite and became infinite
    """

    i: data.View
    o: data.View
    overflow: Signal

    def __init__(self, fmt: FloatFormat, rounding: Rounding, exponents: range):
        self.fmt, self.rounding = fmt, rounding
        self.raw = data.StructLayout({
            "sign": 1,
            "infinite": 1,
            "zero": 1,
            "exp": exponents,
            "man": fmt.man_bits,
            "half": 1,
            "rest": 1,
        })
        super().__init__({"i": In(self.raw), "o": Out(fmt.layout), "overflow": Out(1)})

    def elaborate(self, platform):
        m = Module()

        fmt, x = self.fmt, self.i
        top = (1 << fmt.exp_bits) - 1
        infinity = top << fmt.man_bits
        away, up = Signal(), Signal()  # from zero: in the direction, and this number
        if self.rounding == Rounding.NEAREST:
            m.d.comb += [away.eq(1), up.eq(x.half & (x.rest | x.man[0]))]
            smallest = C(0)
        else:
            m.d.comb += [
                away.eq(x.sign if self.rounding == Rounding.DOWN else ~x.sign),
                up.eq(away & (x.half | x.rest)),
            ]
            smallest = Mux(away, 1 << fmt.man_bits, 0)

        # The carry of a mantissa of all ones counts up the exponent.
        magnitude = Signal(signed(fmt.man_bits + len(x.exp) + 1))
        exponent = Signal(signed(len(x.exp) + 1))
        m.d.comb += [
            magnitude.eq(Cat(x.man, x.exp).as_signed() + up),
            exponent.eq(magnitude >> fmt.man_bits),
            self.o.sign.eq(x.sign),
        ]
        number = Cat(self.o.man, self.o.exp)
        with m.If(x.infinite):
            m.d.comb += number.eq(infinity)
        with m.Elif(x.zero):
            m.d.comb += number.eq(0)
        with m.Elif(exponent < 1):
            m.d.comb += number.eq(smallest)
        with m.Elif(exponent >= top):
            m.d.comb += [number.eq(Mux(away, infinity, infinity - 1)), self.overflow.eq(away)]
        with m.Else():
            m.d.comb += number.eq(magnitude)
        return m
