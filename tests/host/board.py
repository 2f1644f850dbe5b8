"""A board in Python: hdl.link.protocol to the letter, and runs by the golden model.

It shares no code with host.link: what it makes of bytes is its own reading of the protocol.
"""

import struct
import time
import zlib
from collections.abc import Callable

import numpy as np
from cobs import cobs

from hdl.config import Config
from hdl.identification import Surroundings
from hdl.link.protocol import BODY_BYTES, MAGIC, VERSION, Kind, Reason
from hdl.records import word_bits
from hdl.registers import CONTROL_AT, Access, Outcome, registers
from tests.host.machine import run

CONTROL, STATUS, CYCLES = (CONTROL_AT // 4 + k for k in range(3))
REGISTERS = 1024
FOREVER = 1 << 60


class Refusal(Exception):
    """Why a command is refused."""


class BoardModel:
    """Answers bytes with bytes.

    Parameters
    ----------
    config : Config
    words : int
        Of memory.
    clock_hz : int
    version : int
        Of the protocol.
    clock : callable
        Seconds, for CYCLES.

    Attributes
    ----------
    memory : (words, bytes of a word) uint8
    registers : list of int
    changes : list of (kind, body)
        Every WRITE and POKE that was executed.
    polls : int
        Times that STATUS is read before a run ends.
    expected : int
        Sequence number, of `session` if that is not None.
    """

    def __init__(
        self,
        config: Config,
        words: int = 1 << 12,
        *,
        clock_hz: int = 50_000_000,
        version: int = VERSION,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.config, self.version, self.clock_hz, self._clock = config, version, clock_hz, clock
        self.memory = np.zeros((words, word_bits(config.fmt) // 8), np.uint8)
        self._map = {r.offset // 4: r for r in registers(config, Surroundings(words, clock_hz))}
        self._at = {r.name: r.offset // 4 for r in self._map.values()}
        self.polls = 0
        self.fails: Outcome | None = None
        self.failing: range = range(0)
        self.silent = False
        self.changes: list[tuple[Kind, bytes]] = []
        self.reset()

    def reset(self):
        """As after power-up, but for the memory."""
        self.session: int | None = None
        self.expected = 0
        self._begun = bytearray()
        self._left: int | None = None
        self.registers = [0] * REGISTERS
        for at, register in self._map.items():
            self.registers[at] = register.value

    def __setitem__(self, name: str, value: int):
        self.registers[self._at[name]] = value

    def __getitem__(self, name: str) -> int:
        return self.registers[self._at[name]]

    def receive(self, data: bytes) -> bytes:
        """What it answers to bytes."""
        if self.silent:
            return b""
        answers = []
        for byte in data:
            if byte:
                self._begun.append(byte)
            elif self._begun:
                answers += self._frame(bytes(self._begun))
                self._begun.clear()
        return b"".join(answers)

    def _frame(self, encoded: bytes) -> list[bytes]:
        try:
            raw = cobs.decode(encoded)
        except cobs.DecodeError:
            return self._repeat()
        if len(raw) < 11 or zlib.crc32(raw[:-4]) != struct.unpack("<I", raw[-4:])[0]:
            return self._repeat()
        kind, session, number, length = struct.unpack_from("<BHHH", raw)
        body = raw[7:-4]
        if length != len(body):
            return self._repeat()
        if kind == Kind.HELLO.value:
            if session != self.session and body[:1] == bytes([self.version]):
                self.session, self.expected = session, 1
            greeting = struct.pack("<IBH", MAGIC, self.version, BODY_BYTES)
            return [_encode(Kind.OK, session, 0, greeting)]
        if session != self.session:
            return [_encode(Kind.REFUSED, session, number, bytes([Reason.SESSION.value]))]
        behind = (self.expected - number) % (1 << 16)
        if behind > 1 << 15:
            return self._repeat()
        if behind and kind in (Kind.WRITE.value, Kind.POKE.value):
            return [_encode(Kind.OK, session, number)]
        try:
            answer = self._execute(kind, body)
        except Refusal as refusal:
            reason: Reason = refusal.args[0]
            return [_encode(Kind.REFUSED, session, number, bytes([reason.value]))]
        if not behind:
            self.expected = (number + 1) % (1 << 16)
        self["LINK_EXECUTED"] += 1
        return [_encode(Kind.OK, session, number, answer)]

    def _repeat(self) -> list[bytes]:
        self["LINK_DAMAGED"] += 1
        if self.session is None:
            return []
        return [_encode(Kind.REPEAT, self.session, self.expected)]

    def _execute(self, kind: int, body: bytes) -> bytes:
        if kind in (Kind.WRITE.value, Kind.POKE.value):
            self.changes.append((Kind(kind), body))
        commands = {
            Kind.READ.value: self._read,
            Kind.WRITE.value: self._write,
            Kind.PEEK.value: self._peek,
            Kind.POKE.value: self._poke,
        }
        if kind not in commands:
            raise Refusal(Reason.KIND)
        _check(len(body) <= BODY_BYTES)
        return commands[kind](body)

    def _rows(self, address: int, count: int, first: int, size: int) -> np.ndarray:
        words, word = self.memory.shape
        if address + count > words or first + size > word or not count or not size:
            raise Refusal(Reason.RANGE)
        if any(a in self.failing for a in (address, address + count - 1)):
            raise Refusal(Reason.MEMORY)
        return self.memory[address : address + count, first : first + size]

    def _read(self, body: bytes) -> bytes:
        _check(len(body) == 8)
        address, count, first, size = struct.unpack("<IHBB", body)
        _check(count * size <= BODY_BYTES)
        return self._rows(address, count, first, size).tobytes()

    def _write(self, body: bytes) -> bytes:
        _check(len(body) >= 2)
        (first, size), body = body[:2], body[2:]
        while body:
            _check(len(body) >= 6)
            (address, count), body = struct.unpack_from("<IH", body), body[6:]
            rows = self._rows(address, count, first, size)
            _check(len(body) >= rows.size)
            rows[:] = np.frombuffer(body[: rows.size], np.uint8).reshape(rows.shape)
            body = body[rows.size :]
        return b""

    def _peek(self, body: bytes) -> bytes:
        _check(len(body) == 4)
        register, count = struct.unpack("<HH", body)
        _check(4 * count <= BODY_BYTES)
        if not count or register + count > REGISTERS:
            raise Refusal(Reason.RANGE)
        if register <= STATUS < register + count:
            self._tick()
        self.registers[CYCLES] = int(self._clock() * (self.clock_hz or 1000)) % (1 << 32)
        return struct.pack(f"<{count}I", *self.registers[register : register + count])

    def _poke(self, body: bytes) -> bytes:
        _check(len(body) >= 6 and len(body) % 4 == 2)
        register, count = struct.unpack_from("<H", body)[0], len(body) // 4
        if register + count > REGISTERS:
            raise Refusal(Reason.RANGE)
        for at, value in enumerate(struct.unpack_from(f"<{count}I", body, 2), register):
            if at == CONTROL:
                self._control(value)
            elif at in self._map and self._map[at].access == Access.WRITE:
                self.registers[at] = value & ((1 << self._map[at].width) - 1)
        return b""

    @property
    def busy(self) -> bool:
        """A run is under way."""
        return self._left is not None

    def _control(self, value: int):
        if value & 1 and not self.busy:
            self._left = self.polls
            self.registers[STATUS] = 1
        elif value & 2 and self.busy:
            self._end(Outcome.STOPPED)

    def _tick(self):
        """STATUS is read: a run goes on."""
        if self._left is None:
            return
        if self._left:
            self._left -= 1
            return
        if self.fails is None:
            found = run(self.config, self.memory, self._job())
            for name, value in found.items():
                self[name] = value
        self._end(self.fails or Outcome.COMPLETE)

    def _end(self, outcome: Outcome):
        self._left = None
        self.registers[STATUS] = 2 | outcome.value << 2

    def _job(self) -> dict[str, int]:
        writable = (r for r in self._map.values() if r.access == Access.WRITE)
        return {".".join(r.path): self.registers[r.offset // 4] for r in writable}


def _check(right: bool):
    if not right:
        raise Refusal(Reason.LENGTH)


def _encode(kind: Kind, session: int, number: int, body: bytes = b"") -> bytes:
    raw = struct.pack("<BHHH", kind.value, session, number, len(body)) + body
    return cobs.encode(raw + struct.pack("<I", zlib.crc32(raw))) + b"\0"
