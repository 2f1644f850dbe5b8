"""hdl.link.session, as Verilog: which command is the next one, over all numbers."""

import random

import cocotb
from cocotb.triggers import ClockCycles, RisingEdge

from hdl.link.session import Session
from tests.harness import run_cocotb
from tests.streams import start

AROUND = 1 << 16


async def says(dut, session: int, sequence: int) -> tuple[int, int, int]:
    """Of a command: own, next, before."""
    dut.session.value, dut.sequence.value = session, sequence
    await ClockCycles(dut.clk, 2)
    return tuple(int(getattr(dut, name).value) for name in ("own", "next", "before"))


@cocotb.test(timeout_time=100, timeout_unit="ms")
async def numbers_come_around(dut):
    await start(dut, session=0, sequence=0, opens=0, advances=0)
    assert (await says(dut, 0, 0))[0] == 0  # there is none
    dut.session.value, dut.opens.value = 0x1234, 1
    await RisingEdge(dut.clk)
    dut.opens.value = 0
    expected = 1
    for steps in (0, 1, 1, 0x7FFC, 1, 1, 1, 5, 0x7FF6, 1, 1, 1, 1, 1, 0x1234):
        dut.advances.value = bool(steps)
        await ClockCycles(dut.clk, max(1, steps))
        dut.advances.value = 0
        expected = (expected + steps) % AROUND
        near = [0, 1, 2, AROUND // 2 - 1, AROUND // 2, AROUND // 2 + 1, AROUND - 2, AROUND - 1]
        for ahead in [*near, *(random.randrange(AROUND) for _ in range(20))]:
            own, is_next, before = await says(dut, 0x1234, (expected + ahead) % AROUND)
            assert own and is_next == (ahead == 0) and before == (ahead >= AROUND // 2)
        assert int(dut.expected.value) == expected
        for other in (0x1235, 0x9234, 0):
            assert (await says(dut, other, expected))[0] == 0
    dut.session.value, dut.opens.value = 0, 1
    await RisingEdge(dut.clk)
    dut.opens.value = 0
    assert await says(dut, 0, 1) == (1, 1, 0)
    assert await says(dut, 0x1234, 0) == (0, 0, 1)


def test_contract(tmp_path, seed):
    run_cocotb(Session(), __name__, tmp_path, seed=seed)
