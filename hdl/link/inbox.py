"""Frames that came whole wait here until they are read."""

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.link.crc import crc32
from hdl.link.protocol import CRC_BYTES, HEADER_BYTES
from hdl.link.ring import Ring


class Inbox(wiring.Component):
    """Keeps frames whose CRC is right and whose header says how long they are; drops all others.

    Header and body of a frame leave, without its CRC, from 4 cycles after its end on; one byte a
    cycle. A frame that finds no room while it comes, for its CRC too, is lost; those before it
    stay.

    Parameters
    ----------
    size : int
        Bytes that wait, a power of two.

    Members
    -------
    i : In(stream of bytes), decoded, taken at once
    ends : In(1), for a cycle after the last byte of a frame, in which none comes, nor in the next
    good : In(1), with `ends`: its blocks were whole
    o : Out(stream of bytes)
    waits : Out(1), so does a byte here: those of a frame come and go together
    damaged : Out(1), for a cycle at each frame that is dropped but
    lost : Out(1), for a cycle at each that would have been kept if there had been room

    Raises
    ------
    ValueError
        The size is no power of two.
    """

    i: stream.Interface
    ends: Signal
    good: Signal
    o: stream.Interface
    waits: Signal
    damaged: Signal
    lost: Signal

    def __init__(self, size: int):
        self.ring = Ring(size)
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            **dict.fromkeys(("ends", "good"), In(1)),
            "o": Out(stream.Signature(8)),
            **dict.fromkeys(("waits", "damaged", "lost"), Out(1)),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.ring = ring = self.ring
        ended = Signal()  # a frame
        right = Signal(reset_less=True)  # it is one
        m.submodules.crc = crc = crc32(ended)
        wiring.connect(m, ring.o, wiring.flipped(self.o))
        at = Signal.like(ring.end)  # place of the next byte
        count = Signal(range(HEADER_BYTES + 1))  # of its header
        # Bytes of its body, which is what a header ends with; less than 0 in the CRC.
        left = Signal(signed(17))
        short = Signal()  # of room
        m.d.comb += [
            self.waits.eq(~ring.empty),
            ring.place.eq(at),
            ring.top.eq(at),
            ring.data.eq(self.i.payload),
            ring.write.eq(self.i.valid),
            crc.data.eq(self.i.payload),
            crc.valid.eq(self.i.valid),
        ]
        with m.If(self.i.valid):
            m.d.sync += [at.eq(at + ring.room), short.eq(short | ~ring.room)]
            with m.If(count != HEADER_BYTES):
                m.d.sync += [count.eq(count + 1), left.eq(Cat(left[8:16], self.i.payload))]
            with m.Elif(left >= -CRC_BYTES):
                m.d.sync += left.eq(left - 1)

        # stage 1: check
        m.d.sync += [
            ended.eq(self.ends),
            right.eq(
                self.good & crc.match_detected & (count == HEADER_BYTES) & (left == -CRC_BYTES)
            ),
        ]
        # stage 2: keep it, or take it back
        m.d.sync += [self.damaged.eq(ended & ~right), self.lost.eq(ended & right & short)]
        with m.If(ended):
            m.d.sync += [count.eq(0), short.eq(0)]
            with m.If(right & ~short):
                m.d.sync += [at.eq(at - CRC_BYTES), ring.end.eq(at - CRC_BYTES)]
            with m.Else():
                m.d.sync += at.eq(ring.end)
        return m
