"""A register file with several read ports."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.isa import REGISTER_BITS


class RegisterFile(wiring.Component):
    """Registers in memories of one write and one read port, with a copy for each reader.

    A value is there two cycles after its index, one for the memory and one for its way out. A
    write is seen by reads whose index comes after it; where the file forwards, by those of the
    same cycle and of the one before too.

    What is written is then told a cycle before, since values go to many places.

    Parameters
    ----------
    shape : Layout
        Of a register.
    depth, reads : int
        Number of registers and of readers, at least 1.
    forwards : bool
        Whether what is being written goes to readers past the memory.

    Members
    -------
    i : In(stream of {index, value}), taken at once
    coming : In(stream of index), that `i` has in the next cycle; where the file forwards
    indices : In(index) for each reader
    values : Out(shape) for each reader
    """

    i: stream.Interface
    coming: stream.Interface
    indices: list[Signal]
    values: list[data.View]

    def __init__(self, shape: data.Layout, *, depth: int, reads: int, forwards: bool):
        self.shape = shape
        self.depth = depth
        self.forwards = forwards
        entry = data.StructLayout({"index": REGISTER_BITS, "value": shape})
        coming = {"coming": In(stream.Signature(REGISTER_BITS, always_ready=True))}
        super().__init__({
            "i": In(stream.Signature(entry, always_ready=True)),
            **(coming if forwards else {}),
            "indices": In(REGISTER_BITS).array(reads),
            "values": Out(shape).array(reads),
        })

    def elaborate(self, platform):
        m = Module()
        last = None
        if self.forwards:
            last = Signal(self.shape, reset_less=True)
            m.d.sync += last.eq(self.i.p.value)
        for copy, (index, value) in enumerate(zip(self.indices, self.values, strict=True)):
            registers = memory.Memory(shape=self.shape, depth=self.depth, init=[])
            m.submodules[f"copy_{copy}"] = registers
            writes, reads = registers.write_port(), registers.read_port()
            m.d.comb += [
                writes.en.eq(self.i.valid),
                writes.addr.eq(self.i.p.index),
                writes.data.eq(self.i.p.value),
                reads.addr.eq(index),
            ]
            m.d.sync += value.eq(reads.data)
            if last is not None:
                from_i, from_last = Signal(name=f"from_i_{copy}"), Signal(name=f"from_last_{copy}")
                m.d.sync += [
                    from_i.eq(self.coming.valid & (self.coming.payload == index)),
                    from_last.eq(self.i.valid & (self.i.p.index == index)),
                ]
                with m.If(from_i):
                    m.d.sync += value.eq(self.i.p.value)
                with m.Elif(from_last):
                    m.d.sync += value.eq(last)
        return m
