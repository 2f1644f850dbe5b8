"""hdl.link.uart, as Verilog: bytes of a serial line; its other end is not ours."""

import os
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, First, RisingEdge, Timer, ValueChange, with_timeout
from cocotb.utils import get_sim_time

from hdl.link.uart import FEWEST_CYCLES, Receiver, Transmitter, bits_a_cycle
from sim.cosim.verilate import simulator
from tests.harness import SideBySide, run_cocotb
from tests.streams import CYCLE, put, start

CLOCK_HZ = 1e9 / CYCLE
SLOW = 460_800.0 if simulator() == "verilator" else 1_500_000.0
BAUDS = {"fastest": CLOCK_HZ / FEWEST_CYCLES, "odd": 3e6, "slow": SLOW}
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


class Heard:
    """What a receiver says."""

    def __init__(self, dut, name: str):
        self.dut, self.name = dut, name
        self.bytes: list[int] = []
        self.errors = 0

    async def run(self):
        """Listen without end. Both pulses last a cycle, and bytes are many cycles apart."""
        valid, payload, error = (
            getattr(self.dut, f"{self.name}__{x}")
            for x in ("o__valid", "o__payload", "framing_error")
        )
        while True:
            await First(RisingEdge(valid), RisingEdge(error))
            for _ in range(2):
                await FallingEdge(self.dut.clk)
                if valid.value:
                    self.bytes.append(int(payload.value))
                self.errors += int(error.value)


async def listen(dut) -> tuple[Heard, float]:
    """Start with a line at rest; what is heard, and the length of a bit in ns."""
    name = f"receives_{os.environ['UNIT']}"
    await start(dut, **{f"{name}__rx": 1})
    heard = Heard(dut, name)
    cocotb.start_soon(heard.run())
    bit = 1e9 / BAUDS[os.environ["UNIT"]]
    await ns(random.uniform(2, 3) * bit)
    return heard, bit


async def ns(time: float):
    """Wait: a time that need not be one of clock edges."""
    await Timer(round(1000 * time), "ps")


async def drive(heard: Heard, levels, bit: float):
    """Give the line levels, each for so many bits: edges lie where they belong from the first."""
    rx = getattr(heard.dut, f"{heard.name}__rx")
    begun, passed = get_sim_time("ps"), 0.0
    for level, bits in levels:
        rx.value = level
        passed += bits * bit
        await Timer(max(1, round(begun + 1000 * passed - get_sim_time("ps"))), "ps")


def levels_of(sent, stop: float = 1.0):
    for byte in sent:
        yield 0, 1
        for k in range(8):
            yield byte >> k & 1, 1
        yield 1, stop


BYTES = [0x00, 0xFF, 0x55, 0xAA, 0x01, 0x80, 0xFE, 0x7F]


@cocotb.test(timeout_time=100, timeout_unit="ms")
@cocotb.parametrize(rate=[0.98, 1.0, 1.02])
async def what_another_sends_is_received(dut, rate):
    from cocotbext.uart import UartSource

    heard, bit = await listen(dut)
    line = UartSource(getattr(dut, f"{heard.name}__rx"), baud=rate * 1e9 / bit, bits=8)
    sent = [*BYTES, *(random.getrandbits(8) for _ in range(60))]
    await line.write(bytes(sent))
    await line.wait()
    await ns(2 * bit)
    assert heard.bytes == sent and not heard.errors


@cocotb.test(timeout_time=100, timeout_unit="ms")
@cocotb.parametrize(rate=[0.98, 0.99, 1.0, 1.01, 1.02])
async def bytes_without_a_gap_from_any_moment_on(dut, rate):
    """The sender's clock is fast or slow, and begins anywhere in a cycle."""
    heard, bit = await listen(dut)
    for _ in range(8):
        heard.bytes.clear()
        sent = BYTES + [random.getrandbits(8) for _ in range(24)]
        await ns(random.uniform(0, 3) * CYCLE)
        await drive(heard, levels_of(sent), bit / rate)
        await ns(bit)
        assert heard.bytes == sent and not heard.errors


@cocotb.test(timeout_time=100, timeout_unit="ms")
async def a_glitch_is_no_byte(dut):
    """Nor does it spoil the byte after it, or the bit that it is in."""
    heard, bit = await listen(dut)
    for width in (0.05, 0.2, 0.35):
        await drive(heard, [(0, width), (1, 1 - width)], bit)
        await drive(heard, levels_of([0x5A]), bit)
        await ns(bit)
    assert heard.bytes == [0x5A] * 3 and not heard.errors
    heard.bytes.clear()
    if bit / CYCLE < 20:  # samples of a fast line are few, and the edge of a glitch is anywhere
        return
    for middle in (0.375, 0.5, 0.625):  # one of three samples is wrong, in each bit
        for byte in BYTES:
            wrong = []
            for level, _ in levels_of([byte]):
                wrong += [(level, middle - 0.05), (1 - level, 0.1), (level, 0.95 - middle)]
            await drive(heard, wrong, bit)
        await ns(bit)
    assert heard.bytes == BYTES * 3 and not heard.errors


@cocotb.test(timeout_time=100, timeout_unit="ms")
async def a_byte_with_a_wrong_end_is_dropped(dut):
    heard, bit = await listen(dut)
    for errors, low in enumerate([1.0, 3.0, 100.0], 1):  # of which the last two are breaks
        bad = [*levels_of([0xC3])][:-1]
        await drive(heard, [*levels_of([1]), *bad, (0, low), (1, 1.5), *levels_of([2])], bit)
        await ns(bit)
        assert heard.bytes == [1, 2] * errors and heard.errors == errors
    await drive(heard, [(0, 9.4), (1, 1), *levels_of([3])], bit)  # a whole byte of zeros
    await ns(bit)
    assert heard.bytes[-2:] == [0, 3] and heard.errors == 3


@cocotb.test(timeout_time=100, timeout_unit="ms")
async def a_byte_is_there_soon_after_the_middle_of_its_stop_bit(dut):
    heard, bit = await listen(dut)
    await drive(heard, [*levels_of([0x3C])][:-1], bit)
    getattr(dut, f"{heard.name}__rx").value = 1
    await ns(0.6 * bit - CYCLE)
    assert not heard.bytes
    await ns(0.2 * bit + 5 * CYCLE)
    assert heard.bytes == [0x3C]


@pytest.mark.parametrize("name", BAUDS)
def test_contract(name, tmp_path, seed):
    rates = {name: {"clock_hz": CLOCK_HZ, "baud": baud} for name, baud in BAUDS.items()}
    units = SideBySide({
        **{name: Transmitter(**rate) for name, rate in rates.items()},
        **{f"receives_{name}": Receiver(**rate) for name, rate in rates.items()},
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
