"""Answers: a body that was put together, behind a header and before a CRC."""

from amaranth import *
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.link.cobs import PART
from hdl.link.crc import crc32
from hdl.link.protocol import BODY_BYTES, CRC_BYTES, HEADER, HEADER_BYTES
from hdl.link.ring import Ring

ANSWER = data.StructLayout({"kind": 8, "session": 16, "sequence": 16})
"""The header of an answer, but its length."""


class Part(enum.Enum, shape=2):
    """Of a frame."""

    NONE = 0
    HEADER = 1
    BODY = 2
    CRC = 3


class Outbox(wiring.Component):
    """Holds the body of an answer while it is put together, and gives the frame.

    A byte of the frame a cycle, but two between header and body.

    Members
    -------
    i_bytes : In(stream of bytes), of the body, taken at once while nothing is under way
    full : Out(1), the body has all the bytes that one can have
    clear : In(1), it has none
    i : In(stream of ANSWER), the body is whole; taken when the frame has been given
    o : Out(stream of PART), the frame
    """

    i_bytes: stream.Interface
    full: Signal
    clear: Signal
    i: stream.Interface
    o: stream.Interface

    def __init__(self):
        super().__init__({
            "i_bytes": In(stream.Signature(8, always_ready=True)),
            "full": Out(1),
            "clear": In(1),
            "i": In(stream.Signature(ANSWER)),
            "o": Out(stream.Signature(PART)),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.body = body = Ring(BODY_BYTES)
        part = Signal(Part)
        at_byte = Signal(3)  # of header or CRC
        m.submodules.crc = crc = crc32(part == Part.NONE)
        at = Signal.like(body.end)  # place of the next byte of the body
        length = Signal.like(body.end)
        m.d.comb += [
            body.place.eq(at),
            body.top.eq(at),
            body.data.eq(self.i_bytes.payload),
            body.write.eq(self.i_bytes.valid),
            self.full.eq(length == BODY_BYTES),
        ]
        with m.If(self.clear):
            m.d.sync += [at.eq(body.end), length.eq(0)]
        with m.Elif(self.i_bytes.valid & ~self.full):
            m.d.sync += [at.eq(at + 1), length.eq(length + 1)]

        header = Signal(HEADER)
        m.d.comb += [
            header.kind.eq(self.i.p.kind),
            header.session.eq(self.i.p.session),
            header.sequence.eq(self.i.p.sequence),
            header.length.eq(length),
        ]
        given = Signal()  # a byte
        m.d.comb += [
            given.eq(self.o.valid & self.o.ready),
            crc.data.eq(self.o.p.data),
            crc.valid.eq(given),
        ]
        with m.Switch(part):
            with m.Case(Part.NONE):
                m.d.sync += at_byte.eq(0)
                with m.If(self.i.valid):
                    m.d.sync += part.eq(Part.HEADER)
            with m.Case(Part.HEADER):
                m.d.comb += [
                    self.o.valid.eq(1),
                    self.o.p.data.eq(Value.cast(header).word_select(at_byte, 8)),
                ]
                with m.If(given):
                    m.d.sync += at_byte.eq(at_byte + 1)
                    with m.If(at_byte == HEADER_BYTES - 1):
                        m.d.sync += [at_byte.eq(0), body.end.eq(at)]
                        m.d.sync += part.eq(Mux(length == 0, Part.CRC, Part.BODY))
            with m.Case(Part.BODY):
                m.d.comb += [
                    self.o.valid.eq(body.o.valid),
                    self.o.p.data.eq(body.o.payload),
                    body.o.ready.eq(self.o.ready),
                ]
                with m.If(given):
                    m.d.sync += length.eq(length - 1)
                    with m.If(length == 1):
                        m.d.sync += part.eq(Part.CRC)
            with m.Case(Part.CRC):
                last = at_byte == CRC_BYTES - 1
                m.d.comb += [
                    self.o.valid.eq(1),
                    self.o.p.data.eq(crc.crc.word_select(at_byte[:2], 8)),
                    self.o.p.last.eq(last),
                    # The CRC stands while it is given.
                    crc.valid.eq(0),
                    self.i.ready.eq(given & last),
                ]
                with m.If(given):
                    m.d.sync += at_byte.eq(at_byte + 1)
                    with m.If(last):
                        m.d.sync += part.eq(Part.NONE)
        return m
