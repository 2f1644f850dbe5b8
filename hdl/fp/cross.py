"""The difference of two products, with the exact sign."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.fp.add import Add
from hdl.fp.format import FloatFormat
from hdl.fp.mul import Product


class Cross(wiring.Component):
    """a * b - c * d, exact but for one rounding to nearest. Takes `latency` cycles; one a cycle.

    The result has wider exponents, so that no difference of finite products is above or below
    all numbers: it is zero if the products are equal and only then, and its sign is that of the
    exact difference.

    ============ ============ ==============
    a * b        c * d        a * b - c * d
    ============ ============ ==============
    infinity     finite       a * b
    finite       infinity     -(c * d)
    infinity     the same     +0
    infinity     -(a * b)     a * b
    finite       the same     +0
    ============ ============ ==============

    Here a product with zero is zero, of infinity too, and one of infinity with anything else is
    the infinity of the product's sign.

    Parameters
    ----------
    fmt : FloatFormat

    Members
    -------
    i : In(stream of {a, b, c, d: fmt})
    o : Out(stream of fmt.difference), in the order of the inputs

    Raises
    ------
    ValueError
        `fmt` has no format of differences.
    """

    latency = 1 + Add.latency
    i: stream.Interface
    o: stream.Interface

    def __init__(self, fmt: FloatFormat):
        self.fmt = fmt
        super().__init__({
            "i": In(stream.Signature(data.StructLayout(dict.fromkeys("abcd", fmt.layout)))),
            "o": Out(stream.Signature(fmt.difference.layout)),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, x = self.fmt, self.i.p
        to = fmt.product
        m.submodules.add = add = Add(to, to=fmt.difference)
        wiring.connect(m, wiring.flipped(self.o), add.o)

        # stage 1: multiply
        offset = fmt.product.bias - 2 * fmt.bias
        m.d.comb += self.i.ready.eq(add.i.ready)
        with m.If(add.i.ready):
            m.d.sync += add.i.valid.eq(self.i.valid)
        for name, a, b, minus in [("a", x.a, x.b, 0), ("b", x.c, x.d, 1)]:
            m.submodules[f"product_{name}"] = product = Product(fmt, offset)
            term = Signal(to.layout, name=f"term_{name}", reset_less=True)
            m.d.comb += add.i.p[name].eq(term)
            m.d.comb += [product.a.eq(a), product.b.eq(b)]
            zero, infinite = ~a.exp.any() | ~b.exp.any(), a.exp.all() | b.exp.all()
            exponent = product.exp | infinite.replicate(to.exp_bits)
            with m.If(add.i.ready):
                m.d.sync += [
                    term.sign.eq((product.sign ^ minus) & ~zero),
                    term.exp.eq(Mux(zero, 0, exponent)),
                    term.man.eq(product.man),
                ]
        return m
