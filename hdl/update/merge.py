"""The two merge units: three vertices to a box, and two boxes to one."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.fp.format import FloatFormat
from hdl.fp.order import less

AXES = "xyz"


class Merge3(wiring.Component):
    """Smallest box that holds three vertices; exact. Takes `latency` cycles; one box a cycle.

    Parameters
    ----------
    fmt : FloatFormat
        Format of the coordinates. Minus zero is less than zero.

    Members
    -------
    i : In(stream of {v0, v1, v2: vertex})
    o : Out(stream of box), in the order of the inputs
    """

    latency = 1
    i: stream.Interface
    o: stream.Interface

    def __init__(self, fmt: FloatFormat):
        vertex = records.vertex(fmt)
        self.vertices = data.StructLayout({"v0": vertex, "v1": vertex, "v2": vertex})
        super().__init__({
            "i": In(stream.Signature(self.vertices)),
            "o": Out(stream.Signature(records.box(fmt))),
        })

    def elaborate(self, platform):
        m = Module()

        step = ~self.o.valid | self.o.ready
        m.d.comb += self.i.ready.eq(step)
        vertices = Signal(self.vertices, reset_less=True)
        with m.If(step):
            m.d.sync += [vertices.eq(self.i.p), self.o.valid.eq(self.i.valid)]

        for axis in AXES:
            less01, less12, less02 = (
                Signal(name=f"less{pair}_{axis}", reset_less=True) for pair in ("01", "12", "02")
            )
            i0, i1, i2 = (self.i.p[v][axis] for v in ("v0", "v1", "v2"))
            with m.If(step):
                m.d.sync += [  # stage 1: compare
                    less01.eq(less(i0, i1)),
                    less12.eq(less(i1, i2)),
                    less02.eq(less(i0, i2)),
                ]
            v0, v1, v2 = (vertices[v][axis] for v in ("v0", "v1", "v2"))
            m.d.comb += [  # after it: select
                self.o.p.lo[axis].eq(Mux(less01, Mux(less02, v0, v2), Mux(less12, v1, v2))),
                self.o.p.hi[axis].eq(Mux(less01, Mux(less12, v2, v1), Mux(less02, v2, v0))),
            ]
        return m


class Merge2(wiring.Component):
    """Bounds of two boxes on an axis, and the smallest box that holds both; exact.

    Takes `latency` cycles; one union a cycle.

    Parameters
    ----------
    fmt : FloatFormat
        Format of the coordinates. Minus zero is less than zero.

    Members
    -------
    i : In(stream of {b0, b1: box, axis: 0 to 2})
    o : Out(stream of {bounds: of b0 and b1 on the axis, box}), in the order of the inputs
    """

    latency = 1
    i: stream.Interface
    o: stream.Interface

    def __init__(self, fmt: FloatFormat):
        box = records.box(fmt)
        self.boxes = data.StructLayout({"b0": box, "b1": box})
        self.bounds = records.bounds(fmt)
        super().__init__({
            "i": In(stream.Signature(data.StructLayout({"b0": box, "b1": box, "axis": 2}))),
            "o": Out(stream.Signature(data.StructLayout({"bounds": self.bounds, "box": box}))),
        })

    def elaborate(self, platform):
        m = Module()

        step = ~self.o.valid | self.o.ready
        m.d.comb += self.i.ready.eq(step)
        boxes = Signal(self.boxes, reset_less=True)
        bounds = Signal(self.bounds, reset_less=True)
        with m.If(step):
            m.d.sync += [
                boxes.b0.eq(self.i.p.b0),
                boxes.b1.eq(self.i.p.b1),
                self.o.valid.eq(self.i.valid),
            ]
            with m.Switch(self.i.p.axis):
                for index, axis in enumerate(AXES):
                    with m.Case(index):
                        m.d.sync += [
                            bounds.left_lo.eq(self.i.p.b0.lo[axis]),
                            bounds.left_hi.eq(self.i.p.b0.hi[axis]),
                            bounds.right_lo.eq(self.i.p.b1.lo[axis]),
                            bounds.right_hi.eq(self.i.p.b1.hi[axis]),
                        ]
        m.d.comb += self.o.p.bounds.eq(bounds)

        for axis in AXES:
            lower1 = Signal(name=f"lower1_{axis}", reset_less=True)
            higher1 = Signal(name=f"higher1_{axis}", reset_less=True)
            with m.If(step):
                m.d.sync += [  # stage 1: compare
                    lower1.eq(less(self.i.p.b1.lo[axis], self.i.p.b0.lo[axis])),
                    higher1.eq(less(self.i.p.b0.hi[axis], self.i.p.b1.hi[axis])),
                ]
            m.d.comb += [  # after it: select
                self.o.p.box.lo[axis].eq(Mux(lower1, boxes.b1.lo[axis], boxes.b0.lo[axis])),
                self.o.p.box.hi[axis].eq(Mux(higher1, boxes.b1.hi[axis], boxes.b0.hi[axis])),
            ]
        return m
