"""hdl.board with memory on AXI4, as Verilog: on a memory and a serial port that are not ours."""

import random
import struct

import cocotb
import pytest
from cocotb.triggers import RisingEdge, with_timeout

from hdl.board import Board
from hdl.config import TINY
from hdl.link.protocol import VERSION, Kind, Reason
from hdl.link.uart import FEWEST_CYCLES
from hdl.records import word_bits
from tests.axi import WARNINGS, Ram
from tests.harness import run_cocotb
from tests.hdl.link.host import decode, encode
from tests.hdl.link.reference import Frame
from tests.streams import CYCLE, start

CLOCK_HZ = 1e9 / CYCLE
BAUD = CLOCK_HZ / FEWEST_CYCLES
BYTES = word_bits(TINY.fmt) // 8
WORDS = 1000


class Host:
    """A host that asks one thing after the other."""

    def __init__(self, dut, stalls: float):
        from cocotbext.uart import UartSink, UartSource

        self.ram = Ram(dut, "m_axi_", BYTES << TINY.address_bits, stalls)
        self.up = UartSource(dut.rx, baud=BAUD, bits=8)
        self.down = UartSink(dut.tx, baud=BAUD, bits=8)
        self.session, self.sequence = random.randrange(1, 1 << 16), 0

    async def ask(self, kind: Kind, body: bytes) -> Frame:
        self.up.write_nowait(encode(Frame(kind.value, self.session, self.sequence, body)))
        self.sequence += 1
        line = bytearray()
        while not line or line[-1]:
            line += await with_timeout(self.down.read(1), 2, "ms")
        return decode(bytes(line[:-1]))


async def begin(dut, stalls: float = 0.0) -> Host:
    await start(dut, rx=1)
    host = Host(dut, stalls)
    for _ in range(20):  # the line has been high for a while
        await RisingEdge(dut.clk)
    assert (await host.ask(Kind.HELLO, bytes([VERSION]))).kind == Kind.OK.value
    return host


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.5])
async def what_is_written_is_in_the_memory_and_read_back(dut, stalls):
    host = await begin(dut, stalls)
    for count in (1, 7, 40):
        address, data = random.randrange(WORDS - count), random.randbytes(count * BYTES)
        run = struct.pack("<BBIH", 0, BYTES, address, count)
        assert (await host.ask(Kind.WRITE, run + data)).kind == Kind.OK.value
        found = host.ram.memory.read(address * BYTES, count * BYTES)
        assert bytes(found) == data, "an answer says that it is there"
        read = await host.ask(Kind.READ, struct.pack("<IHBB", address, count, 0, BYTES))
        assert (read.kind, read.body) == (Kind.OK.value, data)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def a_memory_that_fails_is_reported_and_the_next_command_works(dut):
    host = await begin(dut)
    refusal = Kind.REFUSED.value, bytes([Reason.MEMORY.value])
    read = Kind.READ, struct.pack("<IHBB", 20, 1, 0, BYTES)
    write = Kind.WRITE, struct.pack("<BBIH", 0, BYTES, 20, 1) + bytes(BYTES)
    for (kind, body), faults in [
        (read, host.ram.read_faults),
        (write, host.ram.write_faults),
    ]:
        faults.update(range(20 * BYTES, 21 * BYTES))
        answer = await host.ask(kind, body)
        assert (answer.kind, answer.body) == refusal
        faults.clear()
        host.sequence -= 1  # the same number stays expected
        assert (await host.ask(kind, body)).kind == Kind.OK.value
    beyond = await host.ask(Kind.READ, struct.pack("<IHBB", WORDS, 1, 0, BYTES))
    assert (beyond.kind, beyond.body) == (refusal[0], bytes([Reason.RANGE.value]))


@pytest.mark.slow
def test_memory_on_axi(tmp_path, seed):
    unit = Board(TINY, words=WORDS, clock_hz=CLOCK_HZ, baud=BAUD, on_chip=False)
    warnings = f"{WARNINGS},ignore::DeprecationWarning:cocotbext.uart.uart"
    run_cocotb(unit, __name__, tmp_path, seed=seed, PYTHONWARNINGS=warnings)
