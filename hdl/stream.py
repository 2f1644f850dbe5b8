"""Parts of streams: what cuts their paths."""

from amaranth import *
from amaranth.lib import fifo, stream, wiring
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


class Landing(wiring.Component):
    """Where waits what leaves a pipeline, so that the pipeline itself never has to.

    Nothing enters the pipeline without `room` for it here. Takes `latency` cycles; one a cycle, if
    it is two deeper than the pipeline and these together.

    Parameters
    ----------
    shape : ShapeLike
        Of what leaves.
    depth : int
        Most that are in the pipeline and here together.

    Members
    -------
    room : Out(1), one more can enter
    enters : In(1), one does
    i : In(stream of shape), taken at once
    o : Out(stream of shape)
    """

    latency = 2
    room: Signal
    enters: Signal
    i: stream.Interface
    o: stream.Interface

    def __init__(self, shape, depth: int):
        self.depth = depth
        super().__init__({
            "room": Out(1),
            "enters": In(1),
            "i": In(stream.Signature(shape, always_ready=True)),
            "o": Out(stream.Signature(shape)),
        })

    def elaborate(self, platform):
        m = Module()
        width = len(Value.cast(self.i.payload))
        m.submodules.waiting = waiting = fifo.SyncFIFOBuffered(width=width, depth=self.depth)
        free = Signal(range(self.depth + 1), init=self.depth)
        m.d.sync += free.eq(free - self.enters + (self.o.valid & self.o.ready))
        m.d.comb += [
            self.room.eq(free != 0),
            waiting.w_en.eq(self.i.valid),
            waiting.w_data.eq(self.i.payload),
            self.o.valid.eq(waiting.r_rdy),
            Value.cast(self.o.payload).eq(waiting.r_data),
            waiting.r_en.eq(self.o.ready),
        ]
        return m
