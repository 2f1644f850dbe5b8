"""What a board has to do and to answer, in Python: hdl.link.protocol, read by another."""

import struct
from dataclasses import dataclass, field

from hdl.link.protocol import BODY_BYTES, MAGIC, VERSION, Kind, Reason

REGISTERS = 1024


@dataclass(frozen=True)
class Frame:
    """A command, or an answer."""

    kind: int
    session: int
    sequence: int
    body: bytes = b""


@dataclass
class Board:
    """The board's end of the link.

    Attributes
    ----------
    word_bytes : int
    words : dict of address to word
        All that there are, from 0 on.
    registers : list of int
    asks : int
        Frames that are to come again, since REPEAT was answered last.
    done : int
        Commands that were executed without a fault.
    """

    word_bytes: int
    words: dict[int, int]
    registers: list[int] = field(default_factory=lambda: [0] * REGISTERS)
    session: int | None = None
    expected: int = 0
    asks: int = 0
    done: int = 0

    def receive(self, frame: Frame) -> Frame | None:
        """Do what a whole frame says; its answer."""
        if frame.kind == Kind.HELLO.value:
            return self._answer(frame, self._hello(frame))
        if frame.session != self.session:
            return self._answer(frame, Reason.SESSION)
        ago = (self.expected - frame.sequence) % (1 << 16)
        if ago > 1 << 15:
            self.asks += 1
            return None
        if ago and frame.kind in (Kind.WRITE.value, Kind.POKE.value):
            return Frame(Kind.OK.value, frame.session, frame.sequence)
        said = self._execute(frame)
        if not ago and not isinstance(said, Reason):
            self.expected = (self.expected + 1) % (1 << 16)
        return self._answer(frame, said)

    def drop(self):
        """A frame was damaged or lost."""
        self.asks += 1

    def repeat(self) -> Frame | None:
        """The answer to all that is to come again, once nothing else waits."""
        asks, self.asks = self.asks, 0
        if asks and self.session is not None:
            return Frame(Kind.REPEAT.value, self.session, self.expected)
        return None

    def _answer(self, frame: Frame, said: bytes | Reason) -> Frame:
        if isinstance(said, Reason):
            body = bytes([said.value])
            return Frame(Kind.REFUSED.value, frame.session, frame.sequence, body)
        self.done += 1
        return Frame(Kind.OK.value, frame.session, frame.sequence, said)

    def _hello(self, frame: Frame) -> bytes | Reason:
        if len(frame.body) != 1:
            return Reason.LENGTH
        if frame.session != self.session and frame.body[0] == VERSION:
            self.session, self.expected = frame.session, 1
        return struct.pack("<IBH", MAGIC, VERSION, BODY_BYTES)

    def _execute(self, frame: Frame) -> bytes | Reason:
        match frame.kind:
            case Kind.READ.value:
                return self._read(frame.body)
            case Kind.WRITE.value:
                return self._write(frame.body)
            case Kind.PEEK.value:
                return self._peek(frame.body)
            case Kind.POKE.value:
                return self._poke(frame.body)
        return Reason.KIND

    def _there(self, address: int, count: int, first: int, size: int) -> bool:
        return (
            count > 0
            and size > 0
            and address + count <= len(self.words)
            and first + size <= self.word_bytes
        )

    def _read(self, body: bytes) -> bytes | Reason:
        if len(body) != 8:
            return Reason.LENGTH
        address, count, first, size = struct.unpack("<IHBB", body)
        if not self._there(address, count, first, size):
            return Reason.RANGE
        if count * size > BODY_BYTES:
            return Reason.LENGTH
        words = (self.words[address + k].to_bytes(self.word_bytes, "little") for k in range(count))
        return b"".join(word[first : first + size] for word in words)

    def _write(self, body: bytes) -> bytes | Reason:
        if not 2 <= len(body) <= BODY_BYTES:
            return Reason.LENGTH
        (first, size), rest = body[:2], body[2:]
        while rest:
            if len(rest) < 6:
                return Reason.LENGTH
            address, count = struct.unpack("<IH", rest[:6])
            rest = rest[6:]
            if not self._there(address, count, first, size):
                return Reason.RANGE
            for k in range(address, address + count):
                if len(rest) < size:
                    return Reason.LENGTH
                word = bytearray(self.words[k].to_bytes(self.word_bytes, "little"))
                word[first : first + size], rest = rest[:size], rest[size:]
                self.words[k] = int.from_bytes(word, "little")
        return b""

    def _peek(self, body: bytes) -> bytes | Reason:
        if len(body) != 4:
            return Reason.LENGTH
        register, count = struct.unpack("<HH", body)
        if not count or register + count > REGISTERS:
            return Reason.RANGE
        if 4 * count > BODY_BYTES:
            return Reason.LENGTH
        return struct.pack(f"<{count}I", *self.registers[register : register + count])

    def _poke(self, body: bytes) -> bytes | Reason:
        if len(body) % 4 != 2 or len(body) > BODY_BYTES:
            return Reason.LENGTH
        (register,), count = struct.unpack("<H", body[:2]), len(body) // 4
        if count and register + count > REGISTERS:
            return Reason.RANGE
        self.registers[register : register + count] = struct.unpack(f"<{count}I", body[2:])
        return b""
