"""Two streams into one, with room for all that can come."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out


class Queue(wiring.Component):
    """Joins two streams that cannot wait; the first is served first.

    Takes `latency` cycles; one a cycle.

    Parameters
    ----------
    shape : Layout
        Of what is queued.
    depth : int
        Most that are ever waiting.

    Members
    -------
    i : two of In(stream of shape), taken at once
    o : Out(stream of shape)
    """

    latency = 2
    i: list[stream.Interface]
    o: stream.Interface

    def __init__(self, shape: data.Layout, depth: int):
        self.shape, self.depth = shape, depth
        super().__init__({
            "i": In(stream.Signature(shape, always_ready=True)).array(2),
            "o": Out(stream.Signature(shape)),
        })

    def elaborate(self, platform):
        m = Module()

        step = ~self.o.valid | self.o.ready
        with m.If(step):
            m.d.sync += self.o.valid.eq(0)
        taken = Const(0)
        for index, i in enumerate(self.i):
            waiting = fifo.SyncFIFO(width=len(self.o.p.as_value()), depth=self.depth)
            m.submodules[f"waiting_{index}"] = waiting
            m.d.comb += [
                waiting.w_en.eq(i.valid),
                waiting.w_data.eq(i.p),
                waiting.r_en.eq(step & ~taken),
            ]
            with m.If(waiting.r_rdy & waiting.r_en):
                m.d.sync += [self.o.valid.eq(1), self.o.payload.eq(waiting.r_data)]
            taken = taken | waiting.r_rdy
        return m
