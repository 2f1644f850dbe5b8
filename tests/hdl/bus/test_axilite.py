"""hdl.bus.axilite, as Verilog: cocotbext-axi's master against registers in Python."""

import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge
from cocotbext.axi import AxiLiteBus, AxiLiteMaster, AxiResp

from hdl.bus.axilite import AxiLiteSlave
from tests.axi import WARNINGS, pauses, quiet
from tests.harness import run_cocotb
from tests.streams import start

ADDRESS_BITS = 6
COUNT = 1 << ADDRESS_BITS - 2
MISSING = {3, 4, 11}


class Registers:
    """Registers behind the slave: all but some are there."""

    def __init__(self, dut):
        self.dut = dut
        self.values = [0 if k in MISSING else random.getrandbits(32) for k in range(COUNT)]
        self.writes: list[tuple[int, int]] = []

    async def run(self):
        dut = self.dut
        while True:
            await RisingEdge(dut.clk)
            address = dut.registers__address.value.to_unsigned()
            if dut.registers__write.value:
                self.writes.append((address, dut.registers__write_data.value.to_unsigned()))
                if address not in MISSING:
                    self.values[address] = self.writes[-1][1]
            dut.registers__read_data.value = self.values[address]
            dut.registers__missing.value = address in MISSING


async def begin(dut, stalls: float) -> tuple[Registers, AxiLiteMaster]:
    quiet(dut)
    handshakes = ("awvalid", "wvalid", "bready", "arvalid", "rready")
    idle = {f"axi__{name}": 0 for name in handshakes}
    await start(dut, registers__read_data=0, registers__missing=0, **idle)
    # after the reset: cocotbext.axi takes no signal that is unknown
    master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "axi_"), dut.clk, dut.rst)
    registers = Registers(dut)
    cocotb.start_soon(registers.run())
    if stalls:
        write, read = master.write_if, master.read_if
        for channel in (
            write.aw_channel, write.w_channel, write.b_channel, read.ar_channel, read.r_channel,
        ):  # fmt: skip
            channel.set_pause_generator(pauses(stalls))
    return registers, master


def answer(index: int) -> AxiResp:
    return AxiResp.SLVERR if index in MISSING else AxiResp.OKAY


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.4, 0.8])
async def registers_are_read_and_written(dut, stalls):
    registers, master = await begin(dut, stalls)
    expected = []
    for _ in range(150):
        index = random.randrange(COUNT)
        if random.random() < 0.5:
            word = random.getrandbits(32)
            expected.append((index, word))
            done = await master.write(4 * index, word.to_bytes(4, "little"))
        else:
            done = await master.read(4 * index, 4)
            assert done.data == registers.values[index].to_bytes(4, "little")
        assert done.resp == answer(index), f"register {index}"
    assert registers.writes == expected, "each write once"


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.5])
async def reads_and_writes_take_turns(dut, stalls):
    registers, master = await begin(dut, stalls)
    words = [random.getrandbits(32) for _ in range(40)]
    ended = []

    async def write():
        for word in words:
            await master.write(0, word.to_bytes(4, "little"))
        ended.append("writes")

    async def read():
        for _ in words:
            assert (await master.read(4, 4)).data == registers.values[1].to_bytes(4, "little")
        ended.append("reads")

    tasks = [cocotb.start_soon(task()) for task in (write, read)]
    for task in tasks:
        await task
    assert registers.writes == [(0, word) for word in words]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_part_of_a_register_is_not_written(dut):
    registers, master = await begin(dut, 0.0)
    for offset, length in ((0, 1), (1, 1), (2, 2), (0, 3)):
        done = await master.write(20 + offset, bytes(length))
        assert done.resp == AxiResp.SLVERR
    assert not registers.writes
    done = await master.write(20, b"abcd")
    assert done.resp == AxiResp.OKAY
    assert registers.writes == [(5, int.from_bytes(b"abcd", "little"))]


def test_contract(tmp_path, seed):
    run_cocotb(AxiLiteSlave(ADDRESS_BITS), __name__, tmp_path, seed=seed, PYTHONWARNINGS=WARNINGS)


@pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
def test_an_address_has_more_than_that_of_a_byte():
    with pytest.raises(ValueError, match="at least 3 bits, not 2"):
        AxiLiteSlave(2)
