"""A memory with two writers."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

BLOCK_RAM = {"ram_style": "block"}
"""For synthesis: in block RAM although shallow, where LUTs are scarcer. It answers late."""


class Banks(wiring.Component):
    """A memory with two writers: a bank for each, and for each row which bank is newer.

    One read and both writes a cycle, never two writes of one row. A read takes one cycle, and
    does not see what is written in the cycle of its address. (LaForest, Steffan, "Efficient
    Multi-Ported Memories for FPGAs", FPGA 2010.)

    Parameters
    ----------
    shape
        Of a row.
    rows : int
    attrs : dict, optional
        Of the memories, for synthesis.

    Members
    -------
    i : In(stream of {row, value}) of each writer, taken at once
    row : In(row)
    value : Out(shape), of the row one cycle ago
    """

    i: list[stream.Interface]
    row: Signal
    value: data.View | Signal

    def __init__(self, shape, rows: int, attrs: dict | None = None):
        self.shape, self.rows, self.attrs = shape, rows, attrs
        write = data.StructLayout({"row": range(rows), "value": shape})
        super().__init__({
            "i": In(stream.Signature(write, always_ready=True)).array(2),
            "row": In(range(rows)),
            "value": Out(shape),
        })

    def elaborate(self, platform):
        m = Module()

        newer = Signal(self.rows)  # the bank of each row
        chosen = Signal(reset_less=True)
        m.d.sync += chosen.eq(newer.bit_select(self.row, 1))
        for index, write in enumerate(self.i):
            bank = memory.Memory(shape=self.shape, depth=self.rows, init=[], attrs=self.attrs)
            m.submodules[f"bank_{index}"] = bank
            to, of = bank.write_port(), bank.read_port()
            m.d.comb += [
                to.en.eq(write.valid),
                to.addr.eq(write.p.row),
                to.data.eq(write.p.value),
                of.addr.eq(self.row),
            ]
            with m.If(write.valid):
                m.d.sync += newer.bit_select(write.p.row, 1).eq(index)
            with m.If(chosen == index):
                m.d.comb += self.value.eq(of.data)
        return m
