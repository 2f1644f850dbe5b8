"""hdl.stream: what goes in comes out, at once or with waits on both sides."""

import os
import random

import cocotb
import pytest
from amaranth import Cat, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out
from cocotb.triggers import ClockCycles, Timer

from hdl.stream import Landing, Slice
from tests.harness import SideBySide, run_cocotb
from tests.streams import now, put, start, take

WIDTH, STAGES = 8, 5
DEPTH = STAGES + Landing.latency + 2


class Line(wiring.Component):
    """Registers in a row that never wait, and a landing."""

    i: In(stream.Signature(WIDTH))
    o: Out(stream.Signature(WIDTH))

    def elaborate(self, platform):
        m = Module()
        m.submodules.landing = landing = Landing(WIDTH, DEPTH)
        wiring.connect(m, landing.o, wiring.flipped(self.o))
        valid, words = Signal(STAGES), Signal(STAGES * WIDTH)
        m.d.comb += [
            self.i.ready.eq(landing.room),
            landing.enters.eq(self.i.valid & landing.room),
            landing.i.valid.eq(valid[-1]),
            landing.i.p.eq(words[-WIDTH:]),
        ]
        m.d.sync += [valid.eq(Cat(landing.enters, valid)), words.eq(Cat(self.i.p, words))]
        return m


LATENCIES = {"slice": 1, "line": STAGES + Landing.latency}
PORTS = ("i__valid", "o__ready")
HOLDS = {"slice": 2, "line": DEPTH}


async def begin(dut) -> str:
    """Start; the unit's name."""
    await start(dut, **{f"{name}__{port}": 0 for name in LATENCIES for port in PORTS})
    return os.environ["UNIT"]


@cocotb.test()
async def keeps_what_it_takes(dut):
    name = await begin(dut)
    words = [random.getrandbits(WIDTH) for _ in range(500)]
    for idle, busy in [(0, 0), (0.5, 0), (0, 0.5), (0.5, 0.5), (0, 0.9)]:
        sending = cocotb.start_soon(put(dut, f"{name}__i", words, idle))
        assert await take(dut, f"{name}__o", len(words), busy) == words
        await sending


@cocotb.test()
async def takes_its_latency_and_one_a_cycle(dut):
    name = await begin(dut)
    cycles: list[int] = []
    first = now() + 1 + LATENCIES[name]
    sending = cocotb.start_soon(put(dut, f"{name}__i", range(50)))
    await take(dut, f"{name}__o", 50, cycles=cycles)
    assert cycles == list(range(first, first + 50))
    await sending


@cocotb.test()
async def no_more_enter_than_it_holds(dut):
    name = await begin(dut)
    getattr(dut, f"{name}__o__ready").value = 0
    cocotb.start_soon(put(dut, f"{name}__i", range(100)))
    await ClockCycles(dut.clk, 40)
    assert getattr(dut, f"{name}__i__payload").value == HOLDS[name]  # those before it are in
    assert await take(dut, f"{name}__o", 100) == list(range(100))


@cocotb.test()
async def ready_does_not_pass_within_a_cycle(dut):
    name = await begin(dut)
    getattr(dut, f"{name}__o__ready").value = 0
    cocotb.start_soon(put(dut, f"{name}__i", range(100)))
    await ClockCycles(dut.clk, 40)
    await Timer(1, "ns")
    getattr(dut, f"{name}__o__ready").value = 1
    await Timer(1, "ns")
    assert getattr(dut, f"{name}__i__ready").value == 0


@pytest.mark.parametrize("name", LATENCIES)
def test_contract(name, tmp_path, seed):
    units = SideBySide({"slice": Slice(WIDTH), "line": Line()})
    run_cocotb(units, __name__, tmp_path, seed=seed, UNIT=name)
