"""Consistent Overhead Byte Stuffing: frames in which no byte is zero, and a zero byte after each.

S. Cheshire and M. Baker, "Consistent Overhead Byte Stuffing", IEEE/ACM Transactions on
Networking 7(2), 1999. A frame is cut after each of its zero bytes, of which one is thought at its
end, and after 254 others; a block is its length, with the zero counted, and its bytes but the zero.
"""

from amaranth import *
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.link.ring import Ring

LONGEST = 254
"""Most bytes of a block, beside its length."""

PART = data.StructLayout({"data": 8, "last": 1})
"""A byte of a frame; frames have at least one."""


class Decoder(wiring.Component):
    """Gives the bytes of frames and says where these end. One byte a cycle, a cycle late.

    A frame of no bytes is ignored.

    Members
    -------
    i : In(stream of bytes), from the line, taken at once
    o : Out(stream of bytes), of a frame, taken at once
    ends : Out(1), for a cycle: a frame did, before which the byte at `o` was its last
    good : Out(1), with `ends`: its last block was whole
    """

    i: stream.Interface
    o: stream.Interface
    ends: Signal
    good: Signal

    def __init__(self):
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            "o": Out(stream.Signature(8, always_ready=True)),
            "ends": Out(1),
            "good": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        byte = self.i.payload
        left = Signal(8)  # bytes of the block that are to come
        due = Signal()  # a zero byte, if another block comes
        some = Signal()  # bytes of this frame have been given
        m.d.sync += [
            self.o.valid.eq(0),
            self.o.payload.eq(Mux(left == 0, 0, byte)),
            self.ends.eq(0),
            self.good.eq(left == 0),
        ]
        with m.If(self.i.valid):
            with m.If(byte == 0):
                m.d.sync += [self.ends.eq(some | (left != 0)), left.eq(0), due.eq(0), some.eq(0)]
            with m.Elif(left == 0):
                m.d.sync += [left.eq(byte - 1), due.eq(byte != LONGEST + 1)]
                m.d.sync += [self.o.valid.eq(due), some.eq(some | due)]
            with m.Else():
                m.d.sync += [left.eq(left - 1), self.o.valid.eq(1), some.eq(1)]
        return m


class Step(enum.Enum, shape=2):
    """Of the encoder."""

    BYTES = 0
    BLOCK = 1  # give a block its length
    LAST = 2  # as well, to that at the end of a frame
    END = 3  # the zero byte after a frame


class Encoder(wiring.Component):
    """Gives frames as blocks, each followed by a zero byte.

    Takes a byte in two cycles, and one more for the end of a frame. What it gives leaves by a ring,
    in which a block waits for its length; the next one comes in while it is sent.

    Members
    -------
    i : In(stream of PART)
    o : Out(stream of bytes), for the line
    """

    i: stream.Interface
    o: stream.Interface

    def __init__(self):
        super().__init__({"i": In(stream.Signature(PART)), "o": Out(stream.Signature(8))})

    def elaborate(self, platform):
        m = Module()

        m.submodules.ring = ring = Ring(512)  # more than two blocks
        wiring.connect(m, ring.o, wiring.flipped(self.o))
        step = Signal(Step)
        length = Signal(8, init=1)  # of the block: one more than its bytes
        block = Signal.like(ring.end)  # place of its length
        ended = Signal(reset_less=True)  # the byte before was the last one of its frame
        at = Signal.like(ring.end, init=1)  # that of its next byte
        part = Signal.like(self.i.p, reset_less=True)  # a byte that was taken
        full = Signal()  # there is one
        m.d.comb += [self.i.ready.eq(~full), ring.top.eq(at)]
        with m.If(~full):
            m.d.sync += [part.eq(self.i.p), full.eq(self.i.valid)]
        with m.If(step == Step.BYTES):
            m.d.comb += [
                ring.place.eq(at),
                ring.data.eq(part.data),
                ring.write.eq(full & (part.data != 0)),
            ]
            with m.If(full & ring.room):
                m.d.sync += [full.eq(0), ended.eq(part.last)]
                with m.If(part.data == 0):
                    m.d.sync += step.eq(Step.BLOCK)
                with m.Else():
                    m.d.sync += [at.eq(at + 1), length.eq(length + 1)]
                    with m.If(part.last):
                        m.d.sync += step.eq(Step.LAST)
                    with m.Elif(length == LONGEST):
                        m.d.sync += step.eq(Step.BLOCK)
        with m.Else():
            m.d.comb += [
                ring.place.eq(block),
                ring.data.eq(Mux(step == Step.END, 0, length)),
                ring.write.eq(1),
            ]
            with m.If(ring.room):
                m.d.sync += [block.eq(at), at.eq(at + 1), ring.end.eq(at), length.eq(1)]
                with m.Switch(step):
                    with m.Case(Step.BLOCK):  # a zero byte at the end begins one more block
                        m.d.sync += step.eq(Mux(ended, Step.LAST, Step.BYTES))
                    with m.Case(Step.LAST):
                        m.d.sync += step.eq(Step.END)
                    with m.Case(Step.END):
                        m.d.sync += step.eq(Step.BYTES)
        return m
