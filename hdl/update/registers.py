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
    indices : In(index) for each reader
    values : Out(shape) for each reader
    """

    i: stream.Interface
    indices: list[Signal]
    values: list[data.View]

    def __init__(self, shape: data.Layout, *, depth: int, reads: int, forwards: bool):
        self.shape = shape
        self.depth = depth
        self.forwards = forwards
        entry = data.StructLayout({"index": REGISTER_BITS, "value": shape})
        super().__init__({
            "i": In(stream.Signature(entry, always_ready=True)),
            "indices": In(REGISTER_BITS).array(reads),
            "values": Out(shape).array(reads),
        })

    def elaborate(self, platform):
        m = Module()
        last = Signal.like(self.i.p, reset_less=True)
        last_valid = Signal()
        m.d.sync += [last.eq(self.i.p), last_valid.eq(self.i.valid)]
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
            wanted = Signal.like(index, name=f"wanted_{copy}")
            m.d.sync += [wanted.eq(index), value.eq(reads.data)]
            if self.forwards:
                with m.If(self.i.valid & (self.i.p.index == wanted)):
                    m.d.sync += value.eq(self.i.p.value)
                with m.Elif(last_valid & (last.index == wanted)):
                    m.d.sync += value.eq(last.value)
        return m
