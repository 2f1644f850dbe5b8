"""hdl.link.cobs, as Verilog, against the package cobs."""

import itertools
import random

import cocotb
from cobs import cobs
from cocotb.triggers import RisingEdge

from hdl.link.cobs import Decoder, Encoder
from tests.harness import SideBySide, run_cocotb
from tests.streams import now, put, start, take

LENGTHS = [1, 2, 252, 253, 254, 255, 256, 257, 507, 508, 509, 510, 511, 762, 763, 1035]


def frames() -> list[bytes]:
    """All short ones of some bytes, and some near all boundaries of blocks."""
    few = [bytes(f) for n in (1, 2, 3, 4) for f in itertools.product((0, 1, 255), repeat=n)]
    found = few + [bytes([k]) for k in range(256)]
    for length in LENGTHS:
        full = bytes(random.randrange(1, 256) for _ in range(length))
        found += [full, full[:-1] + b"\0", b"\0" + full[1:], bytes(length)]
        at = random.randrange(length)
        found += [full[:at] + b"\0" + full[at + 1 :], random.randbytes(length)]
    random.shuffle(found)
    return found


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("idle", "busy"), [(0.0, 0.0), (0.5, 0.0), (0.0, 0.6), (0.3, 0.3)]))
async def encodes(dut, idle, busy):
    await start(dut, encoder__i__valid=0, encoder__o__ready=0)
    sent = frames()[:: 3 if idle or busy else 1]
    parts = [byte | (k + 1 == len(f)) << 8 for f in sent for k, byte in enumerate(f)]
    expected = b"".join(cobs.encode(f) + b"\0" for f in sent)
    sending = cocotb.start_soon(put(dut, "encoder__i", parts, idle))
    assert bytes(await take(dut, "encoder__o", len(expected), busy)) == expected
    await sending


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(zeros=[0.0, 0.01, 1.0])
async def a_byte_in_two_cycles(dut, zeros):
    """Of long frames: so a line on which a byte takes 80 cycles never waits."""
    await start(dut, encoder__i__valid=0, encoder__o__ready=0)
    frame = bytes(0 if random.random() < zeros else 7 for _ in range(1000))
    cocotb.start_soon(
        put(dut, "encoder__i", [b | (k == 999) << 8 for _ in range(4) for k, b in enumerate(frame)])
    )
    begun, latency = now(), 300  # until the last block has left
    await take(dut, "encoder__o", 4 * len(cobs.encode(frame) + b"\0"))
    assert now() - begun <= 4 * (2 * len(frame) + 2) + latency


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def a_slow_line_never_waits(dut):
    """A byte of it takes 80 cycles, as fast as the transmitter goes; frames come one by one."""
    await start(dut, encoder__i__valid=0, encoder__o__ready=0)
    frame = random.randbytes(1035).replace(b"\0", b"\1")
    cocotb.start_soon(put(dut, "encoder__i", [b | (k == 1034) << 8 for k, b in enumerate(frame)]))
    while not dut.encoder__o__valid.value:
        await RisingEdge(dut.clk)
    for k in range(len(cobs.encode(frame)) + 1):
        for _ in range(79):
            await RisingEdge(dut.clk)
        assert dut.encoder__o__valid.value, f"byte {k} is late"
        dut.encoder__o__ready.value = 1
        await RisingEdge(dut.clk)
        dut.encoder__o__ready.value = 0


async def decode(dut, line: bytes, idle: float = 0.0) -> list[tuple[bytes, bool]]:
    """What the decoder makes of a line: frames, and whether each is good."""
    valid, payload = dut.decoder__i__valid, dut.decoder__i__payload
    found, frame = [], bytearray()
    for byte in [*line, None, None]:
        while byte is None or random.random() < idle:
            valid.value = 0
            await RisingEdge(dut.clk)
            hear(dut, frame, found)
            if byte is None:
                break
        else:
            valid.value, payload.value = 1, byte
            await RisingEdge(dut.clk)
            hear(dut, frame, found)
    assert not frame
    return found


def hear(dut, frame: bytearray, found: list):
    """Note what the decoder says in this cycle."""
    assert not (dut.decoder__o__valid.value and dut.decoder__ends.value)
    if dut.decoder__o__valid.value:
        frame.append(int(dut.decoder__o__payload.value))
    if dut.decoder__ends.value:
        found.append((bytes(frame), bool(dut.decoder__good.value)))
        frame.clear()


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(idle=[0.0, 0.5])
async def decodes(dut, idle):
    await start(dut, decoder__i__valid=0)
    sent = frames()[:: 3 if idle else 1]
    line = b"".join(bytes(random.randrange(3)) + cobs.encode(f) + b"\0" for f in sent)
    assert await decode(dut, line, idle) == [(f, True) for f in sent]


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def every_short_line_is_judged(dut):
    """As the package does: what is cut off in a block is bad, and what has no bytes is no frame."""
    await start(dut, decoder__i__valid=0)
    values = (1, 2, 3, 4, 5, 255)
    lines = [bytes(line) for n in (1, 2, 3, 4) for line in itertools.product(values, repeat=n)]
    lines += [cobs.encode(f)[:-1] for f in (b"\7" * 254, b"\7" * 300, bytes(9))]
    got = await decode(dut, b"".join(line + b"\0" for line in lines))
    for line in lines:
        try:
            whole = cobs.decode(line)
        except cobs.DecodeError:
            assert not got.pop(0)[1], line
        else:
            if whole:
                assert got.pop(0) == (whole, True), line
    assert not got


def test_contract(tmp_path, seed):
    units = SideBySide({"encoder": Encoder(), "decoder": Decoder()})
    run_cocotb(units, __name__, tmp_path, seed=seed)
