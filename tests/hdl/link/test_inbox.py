"""hdl.link.inbox, as Verilog: whole frames are kept, all others are told, and none is mixed up."""

import random
import struct
import zlib

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.link.inbox import Inbox
from tests.harness import SideBySide, run_cocotb
from tests.streams import start, take

SIZE = 64


def framed(body: bytes, length: int | None = None) -> bytes:
    """A frame, decoded: header, body and CRC."""
    length = len(body) if length is None else length
    sent = random.randbytes(5) + struct.pack("<H", length) + body
    return sent + struct.pack("<I", zlib.crc32(sent))


class Bench:
    """Gives frames to an inbox, and counts what it says of them."""

    def __init__(self, dut):
        self.dut = dut
        self.pulses = dict.fromkeys(("damaged", "lost"), 0)

    async def edge(self):
        """The next cycle."""
        await RisingEdge(self.dut.clk)
        for name in self.pulses:
            self.pulses[name] += int(getattr(self.dut, f"inbox__{name}").value)

    async def give(self, frame: bytes, good: bool = True, idle: float = 0.0):
        """A frame as the decoder gives it."""
        dut = self.dut
        for byte in frame:
            while random.random() < idle:
                await self.edge()
            dut.inbox__i__valid.value, dut.inbox__i__payload.value = 1, byte
            await self.edge()
            dut.inbox__i__valid.value = 0
        dut.inbox__ends.value, dut.inbox__good.value = 1, good
        await self.edge()
        dut.inbox__ends.value = 0
        await self.edge()

    async def told(self) -> tuple[int, int]:
        """Frames that were damaged and lost since this was asked last."""
        for _ in range(4):
            await self.edge()
        told = self.pulses["damaged"], self.pulses["lost"]
        self.pulses = dict.fromkeys(self.pulses, 0)
        return told


async def begin(dut) -> Bench:
    names = ("i__valid", "i__payload", "ends", "good", "o__ready")
    await start(dut, **{f"inbox__{name}": 0 for name in names})
    return Bench(dut)


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("idle", "busy"), [(0.0, 0.0), (0.5, 0.7)]))
async def whole_frames_leave(dut, idle, busy):
    bench = await begin(dut)
    for _ in range(60):
        frame = framed(random.randbytes(random.choice([0, 1, 2, 30, SIZE - 11])))
        await bench.give(frame, idle=idle)
        assert bytes(await take(dut, "inbox__o", len(frame) - 4, busy)) == frame[:-4]
    await bench.edge()
    assert not dut.inbox__waits.value
    assert await bench.told() == (0, 0)


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def all_others_do_not(dut):
    bench = await begin(dut)
    good = framed(b"good")
    for k in range(len(good)):  # any bit wrong, any length
        bad = bytearray(good)
        bad[k] ^= 1 << random.randrange(8)
        await bench.give(bytes(bad))
        await bench.give(good[:k])
        assert await bench.told() == (2, 0)
    for length in (0, 3, 5, 11, 15, 0x104, 0xFFFF, 0xFFF9):
        await bench.give(framed(b"good", length))
        assert await bench.told() == (1, 0)
    short = b"123456"
    for n in range(7):  # a right CRC behind less than a header
        await bench.give(short[:n] + struct.pack("<I", zlib.crc32(short[:n])))
        assert await bench.told() == (1, 0)
    await bench.give(good, good=False)
    assert await bench.told() == (1, 0)
    assert not dut.inbox__waits.value
    await bench.give(good)
    assert await bench.told() == (0, 0)
    assert bytes(await take(dut, "inbox__o", 11)) == good[:-4]


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def what_finds_no_room_is_lost(dut):
    """And no part of it is left: what waited before it and what comes after it are whole."""
    bench = await begin(dut)
    waiting: list[bytes] = []
    for _ in range(150):
        left = SIZE - sum(map(len, waiting))
        frame = framed(random.randbytes(random.choice([0, 3, 9, SIZE])))
        bad = random.random() < 0.1
        await bench.give(frame[:-1] + bytes([frame[-1] ^ 1]) if bad else frame)
        damaged, lost = await bench.told()
        assert damaged == bad
        if len(frame) > left + 2:  # two bytes can have gone on to the output
            assert bad or lost
        elif len(frame) <= left:
            assert not lost
        if not bad and not lost:
            waiting.append(frame[:-4])
        while waiting and random.random() < 0.4:
            whole = waiting.pop(0)
            assert bytes(await take(dut, "inbox__o", len(whole))) == whole
    await bench.give(framed(bytes(0xFFFF)))  # never, and it is not taken for a short one
    assert await bench.told() == (0, 1)
    await bench.give(framed(bytes(0x1001), 1))
    assert await bench.told() == (1, 0)
    for whole in waiting:
        assert bytes(await take(dut, "inbox__o", len(whole))) == whole


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def bytes_wait_while_a_frame_does(dut):
    bench = await begin(dut)
    frame = framed(b"12")
    await bench.give(frame)
    await bench.told()
    for byte in frame[:-4]:
        assert dut.inbox__waits.value
        assert await take(dut, "inbox__o", 1) == [byte]
    await bench.edge()
    assert not dut.inbox__waits.value


def test_contract(tmp_path, seed):
    run_cocotb(SideBySide({"inbox": Inbox(SIZE)}), __name__, tmp_path, seed=seed)


@pytest.mark.parametrize("size", [0, 1, 48])
def test_sizes_that_are_none(size):
    with pytest.raises(ValueError, match="power of two"):
        Inbox(size)
