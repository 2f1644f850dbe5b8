"""Bytes in a block RAM, written anywhere and read in their order."""

from amaranth import *
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2


class Ring(wiring.Component):
    """Gives bytes up to a place that its writer moves on; the writer chooses where it writes.

    Places count bytes, modulo twice the size, so that full is not empty. A byte is given three
    cycles after `end` goes past it; one a cycle, but none in the third one after a write.

    Parameters
    ----------
    size : int
        Bytes: a power of two, at least 2.

    Members
    -------
    place : In(place), of the byte to write
    data : In(8)
    write : In(1), there, if there is room
    top : In(place), nothing has been written there or after it
    room : Out(1), the byte that was at `top` has left
    end : In(place), what is before it has been written and leaves
    o : Out(stream of bytes)
    empty : Out(1), all before `end` has left
    """

    place: Signal
    data: Signal
    write: Signal
    top: Signal
    room: Signal
    end: Signal
    o: stream.Interface
    empty: Signal

    def __init__(self, size: int):
        if size < 2 or size & (size - 1):
            raise ValueError(f"a ring has a power of two of bytes, at least 2, not {size}")
        self.size = size
        super().__init__({
            "place": In(range(2 * size)),
            "data": In(8),
            "write": In(1),
            "top": In(range(2 * size)),
            "room": Out(1),
            "end": In(range(2 * size)),
            "o": Out(stream.Signature(8)),
            "empty": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        bits = exact_log2(self.size)
        m.submodules.stored = stored = memory.Memory(shape=8, depth=self.size, init=[])
        writes, reads = stored.write_port(), stored.read_port()
        begin = Signal.like(self.end)  # of what has not been looked up
        found = Signal()  # a byte, in the memory's own register
        step = Signal()  # that register
        read = Signal()  # it takes the next byte
        m.d.comb += [
            self.room.eq((self.top[:bits] != begin[:bits]) | (self.top[bits] == begin[bits])),
            writes.addr.eq(self.place[:bits]),
            writes.data.eq(self.data),
            writes.en.eq(self.write & self.room),
            step.eq(~found | ~self.o.valid | self.o.ready),
            # A tool that finds that these never meet makes nothing to say what happens then.
            read.eq(step & (begin != self.end) & ~writes.en),
            reads.addr.eq(begin[:bits]),
            reads.en.eq(read),
            self.empty.eq((begin == self.end) & ~found & ~self.o.valid),
        ]
        m.d.sync += begin.eq(begin + read)
        with m.If(step):
            m.d.sync += found.eq(read)
        with m.If(~self.o.valid | self.o.ready):
            # Block RAM is slow to answer, so what it says goes no further.
            m.d.sync += [self.o.valid.eq(found), self.o.payload.eq(reads.data)]
        return m
