"""Frames as bytes on the line and back, as hdl.link.protocol describes them."""

import struct
import zlib
from dataclasses import dataclass

from amaranth.hdl import Shape
from amaranth.lib import data
from cobs import cobs

from hdl.link.protocol import BODY_BYTES, CRC_BYTES, HEADER, HEADER_BYTES

CODES = {8: "B", 16: "H", 32: "I"}
LONGEST = HEADER_BYTES + BODY_BYTES + CRC_BYTES
LONGEST += -(-LONGEST // 254)
"""Most bytes between two zeros on the line."""


class Packed:
    """A layout of whole bytes as Python's struct packs it."""

    def __init__(self, layout: data.StructLayout):
        self.names = [str(name) for name, _ in layout]
        widths = [Shape.cast(field.shape).width for _, field in layout]
        self._struct = struct.Struct("<" + "".join(CODES[width] for width in widths))
        self.size = self._struct.size

    def pack(self, **values: int) -> bytes:
        """Bytes of all fields; a value that does not fit is an error."""
        return self._struct.pack(*(values[name] for name in self.names))

    def unpack(self, raw: bytes, offset: int = 0) -> dict[str, int]:
        """Fields by name."""
        return dict(zip(self.names, self._struct.unpack_from(raw, offset), strict=True))


PACKED_HEADER = Packed(HEADER)


@dataclass(frozen=True)
class Frame:
    """A command or an answer.

    Attributes
    ----------
    kind : int
        A value of hdl.link.protocol.Kind, or one that this version does not know.
    session, sequence : int
        16 bits each.
    body : bytes
    """

    kind: int
    session: int
    sequence: int
    body: bytes = b""


def encode(frame: Frame) -> bytes:
    """What goes over the line: the zero that ends it is the last byte, and the only zero."""
    header = PACKED_HEADER.pack(
        kind=frame.kind,
        session=frame.session,
        sequence=frame.sequence,
        length=len(frame.body),
    )
    raw = header + frame.body
    return cobs.encode(raw + zlib.crc32(raw).to_bytes(CRC_BYTES, "little")) + b"\0"


def decode(encoded: bytes) -> Frame | None:
    """The frame between two zeros; None if it is damaged."""
    try:
        raw = cobs.decode(encoded)
    except cobs.DecodeError:
        return None
    end = len(raw) - CRC_BYTES
    if end < HEADER_BYTES or zlib.crc32(raw[:end]) != int.from_bytes(raw[end:], "little"):
        return None
    header = PACKED_HEADER.unpack(raw)
    if header.pop("length") != end - HEADER_BYTES:
        return None
    return Frame(**header, body=raw[HEADER_BYTES:end])


class Deframer:
    """Finds frames in bytes that come piece by piece: after any damage the next good one.

    Attributes
    ----------
    damaged : int
        Frames that were not good.
    """

    def __init__(self):
        self.damaged = 0
        self._begun = bytearray()

    def feed(self, received: bytes) -> list[Frame]:
        """Frames that end in these bytes."""
        *ended, rest = received.split(b"\0")
        found = []
        for part in ended:
            self._add(part)
            if self._begun:
                frame = decode(bytes(self._begun))
                self._begun.clear()
                self.damaged += frame is None
                found += [frame] if frame else []
        self._add(rest)
        return found

    def _add(self, part: bytes):
        """Go on with a frame: what is too long for one is cut off, and stays damaged."""
        self._begun += part[: LONGEST + 1 - len(self._begun)]
