"""A part of streams: what cuts their paths."""

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out


class Slice(wiring.Component):
    """Registers on all of a stream: nothing goes from one side to the other within a cycle.

    Takes one cycle; one a cycle. Holds two, since it hears of a wait a cycle late.

    Parameters
    ----------
    shape : ShapeLike
        Of what passes.

    Members
    -------
    i : In(stream of shape)
    o : Out(stream of shape)
    """

    i: stream.Interface
    o: stream.Interface

    def __init__(self, shape):
        super().__init__({
            "i": In(stream.Signature(shape)),
            "o": Out(stream.Signature(shape)),
        })

    def elaborate(self, platform):
        m = Module()
        spare = Signal.like(self.i.payload, reset_less=True)
        spared = Signal()  # the spare register is in use
        m.d.comb += self.i.ready.eq(~spared)
        with m.If(~spared):
            m.d.sync += spare.eq(self.i.payload)
        with m.If(~self.o.valid | self.o.ready):
            m.d.sync += [
                self.o.valid.eq(self.i.valid | spared),
                self.o.payload.eq(Mux(spared, spare, self.i.payload)),
                spared.eq(0),
            ]
        with m.Else():
            m.d.sync += spared.eq(spared | self.i.valid)
        return m
