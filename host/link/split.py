"""Reads and writes of any length, as commands that fit into frames."""

import struct
from collections.abc import Iterable, Iterator, Sequence

from hdl.link import protocol
from hdl.link.protocol import Kind
from hdl.registers import BYTES
from host.link.frames import Packed
from host.link.window import Command

READ, WRITE, RUN = Packed(protocol.READ), Packed(protocol.WRITE), Packed(protocol.RUN)
PEEK, POKE = Packed(protocol.PEEK), Packed(protocol.POKE)
MOST_WORDS = (1 << 16) - 1


def reads(runs: Iterable[tuple[int, int]], first: int, size: int, most: int) -> Iterator[Command]:
    """READs of runs of words, whose answers take `most` bytes each at most."""
    at_once = min(most // size, MOST_WORDS)
    for address, count in runs:
        for done in range(0, count, at_once):
            words = min(at_once, count - done)
            body = READ.pack(address=address + done, count=words, first=first, bytes=size)
            yield Command(Kind.READ, body, words * size, words * size)


def writes(
    runs: Iterable[tuple[int, bytes]], first: int, size: int, most: int
) -> Iterator[Command]:
    """WRITEs of runs of words, with as many in a frame as it holds."""
    head = WRITE.pack(first=first, bytes=size)
    body, moves = bytearray(head), 0
    for address, data in runs:
        count, done = len(data) // size, 0
        while done < count:
            words = min((most - len(body) - RUN.size) // size, count - done, MOST_WORDS)
            if words < 1:
                yield Command(Kind.WRITE, bytes(body), 0, moves)
                body, moves = bytearray(head), 0
                continue
            body += RUN.pack(address=address + done, count=words)
            body += data[done * size : (done + words) * size]
            done, moves = done + words, moves + words * size
    if moves:
        yield Command(Kind.WRITE, bytes(body), 0, moves)


def peeks(register: int, count: int, most: int) -> Iterator[Command]:
    """PEEKs of registers."""
    at_once = most // BYTES
    for done in range(0, count, at_once):
        some = min(at_once, count - done)
        body = PEEK.pack(register=register + done, count=some)
        yield Command(Kind.PEEK, body, some * BYTES, some * BYTES)


def pokes(runs: Iterable[tuple[int, Sequence[int]]], most: int) -> Iterator[Command]:
    """POKEs of runs of registers."""
    at_once = (most - POKE.size) // BYTES
    for register, values in runs:
        for done in range(0, len(values), at_once):
            some = values[done : done + at_once]
            raw = struct.pack(f"<{len(some)}I", *some)
            yield Command(Kind.POKE, POKE.pack(register=register + done) + raw, 0, len(raw))


def numbers(raw: bytes) -> list[int]:
    """Registers as integers."""
    return list(struct.unpack(f"<{len(raw) // BYTES}I", raw))
