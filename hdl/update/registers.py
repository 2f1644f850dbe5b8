"""A register file with several read ports."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.isa import REGISTER_BITS


class RegisterFile(wiring.Component):
    """Registers in memories of one write and one read port, with a copy for each reader.

    A value is there one cycle after its index; a write is seen by reads of the next cycle on.

    Parameters
    ----------
    shape : Layout
        Of a register.
    depth, reads : int
        Number of registers and of readers, at least 1.

    Members
    -------
    i : In(stream of {index, value}), taken at once
    indices : In(index) for each reader
    values : Out(shape) for each reader
    """

    i: stream.Interface
    indices: list[Signal]
    values: list[data.View]

    def __init__(self, shape: data.Layout, *, depth: int, reads: int):
        self.shape = shape
        self.depth = depth
        entry = data.StructLayout({"index": REGISTER_BITS, "value": shape})
        super().__init__({
            "i": In(stream.Signature(entry, always_ready=True)),
            "indices": In(REGISTER_BITS).array(reads),
            "values": Out(shape).array(reads),
        })

    def elaborate(self, platform):
        m = Module()
        for copy, (index, value) in enumerate(zip(self.indices, self.values, strict=True)):
            registers = memory.Memory(shape=self.shape, depth=self.depth, init=[])
            m.submodules[f"copy_{copy}"] = registers
            writes, reads = registers.write_port(), registers.read_port()
            m.d.comb += [
                writes.en.eq(self.i.valid),
                writes.addr.eq(self.i.p.index),
                writes.data.eq(self.i.p.value),
                reads.addr.eq(index),
                value.eq(reads.data),
            ]
        return m
