"""hdl.link.uart, as Verilog: bytes of a serial line, read by a receiver that is not ours."""

import os
import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge, Timer, ValueChange, with_timeout
from cocotb.utils import get_sim_time

from hdl.link.uart import FEWEST_CYCLES, Transmitter, bits_a_cycle
from tests.harness import SideBySide, run_cocotb
from tests.streams import CYCLE, put, start

CLOCK_HZ = 1e9 / CYCLE
BAUDS = {"fastest": CLOCK_HZ / FEWEST_CYCLES, "odd": 3e6, "slow": 460_800.0}
WARNINGS = "error,ignore::DeprecationWarning:cocotbext.uart.uart"


async def begin(dut) -> tuple[str, float]:
    """Start; the unit's name, and the length of a bit in ns."""
    name = os.environ["UNIT"]
    await start(dut, **{f"{name}__i__valid": 0})
    return name, 1e9 / BAUDS[name]


@cocotb.test(timeout_time=100, timeout_unit="ms")
@cocotb.parametrize(idle=[0.0, 0.99])
async def a_receiver_reads_what_is_sent(dut, idle):
    from cocotbext.uart import UartSink

    name, bit = await begin(dut)
    line = UartSink(getattr(dut, f"{name}__tx"), baud=1e9 / bit, bits=8)
    sent = [0x00, 0xFF, 0x55, 0xAA, *(random.getrandbits(8) for _ in range(60))]
    sending = cocotb.start_soon(put(dut, f"{name}__i", sent, idle))
    received = b""
    while len(received) < len(sent):
        received += await line.read()
    assert list(received) == sent
    await sending


@cocotb.test(timeout_time=100, timeout_unit="ms")
async def edges_are_where_they_belong(dut):
    """Of bytes without a gap, each edge within a cycle of its place, counted from the first."""
    name, bit = await begin(dut)
    count = 100
    cocotb.start_soon(put(dut, f"{name}__i", [0x55] * count))  # an edge at each bit
    tx = getattr(dut, f"{name}__tx")
    await ValueChange(tx)
    begun = get_sim_time("ns")
    for k in range(1, 10 * count):
        await with_timeout(ValueChange(tx), 2 * round(bit) + CYCLE, "ns")
        late = get_sim_time("ns") - begun - k * bit
        drift = k * bit * 1e-4  # a rate that is a fraction of 2**20 is not quite that asked for
        assert -drift <= late + 1e-3 and late < CYCLE + drift, f"edge {k} is {late:.1f} ns late"


@cocotb.test(timeout_time=100, timeout_unit="ms")
async def it_is_busy_while_it_sends(dut):
    name, bit = await begin(dut)
    busy, tx = (getattr(dut, f"{name}__{x}") for x in ("busy", "tx"))
    await Timer(round(3 * bit), "ns")
    assert (int(busy.value), int(tx.value)) == (0, 1)
    await RisingEdge(dut.clk)
    await put(dut, f"{name}__i", [0])
    await ValueChange(busy)
    begun = get_sim_time("ns")
    await ValueChange(busy)
    assert abs(get_sim_time("ns") - begun - 10 * bit) <= CYCLE


@pytest.mark.parametrize("name", BAUDS)
def test_contract(name, tmp_path, seed):
    units = SideBySide({
        name: Transmitter(clock_hz=CLOCK_HZ, baud=baud) for name, baud in BAUDS.items()
    })
    run_cocotb(units, __name__, tmp_path, seed=seed, UNIT=name, PYTHONWARNINGS=WARNINGS)


@pytest.mark.parametrize(("clock_hz", "baud"), [(25e6, 4e6), (100e6, 1000)])
def test_rates_that_are_none(clock_hz, baud):
    with pytest.raises(ValueError, match="baud"):
        bits_a_cycle(clock_hz, baud)


@pytest.mark.parametrize("clock_hz", [25e6, 50e6, 66e6, 75e6, 100e6])
@pytest.mark.parametrize("baud", [115_200, 921_600, 3_000_000])
def test_usual_rates_are_met(clock_hz, baud):
    found = bits_a_cycle(clock_hz, baud) / (1 << 20) * clock_hz
    assert abs(found / baud - 1) < 1e-3
