"""hdl.stream.Landing behind a pipeline that never waits: nothing is lost, one a cycle."""

import random

import cocotb
from amaranth import Cat, Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out
from cocotb.triggers import ClockCycles

from hdl.stream import Landing
from tests.harness import run_cocotb
from tests.streams import now, put, start, take

WIDTH, STAGES = 8, 5
DEPTH = STAGES + Landing.latency + 2


class Line(wiring.Component):
    """Registers in a row, and a landing."""

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


@cocotb.test()
async def keeps_what_enters(dut):
    words = [random.getrandbits(WIDTH) for _ in range(500)]
    await start(dut, i__valid=0, o__ready=0)
    for idle, busy in [(0, 0), (0.5, 0), (0, 0.5), (0.5, 0.5), (0, 0.9)]:
        sending = cocotb.start_soon(put(dut, "i", words, idle))
        assert await take(dut, "o", len(words), busy) == words
        await sending


@cocotb.test()
async def takes_its_latency_and_one_a_cycle(dut):
    await start(dut, i__valid=0, o__ready=0)
    cycles: list[int] = []
    begin = now()
    sending = cocotb.start_soon(put(dut, "i", range(50)))
    await take(dut, "o", 50, cycles=cycles)
    first = begin + 1 + STAGES + Landing.latency
    assert cycles == list(range(first, first + 50))
    await sending


@cocotb.test()
async def no_more_enter_than_it_holds(dut):
    await start(dut, i__valid=0, o__ready=0)
    cocotb.start_soon(put(dut, "i", range(100)))
    await ClockCycles(dut.clk, 40)
    assert dut.i__payload.value == DEPTH  # those before it are in
    assert await take(dut, "o", 100) == list(range(100))


def test_contract(tmp_path, seed):
    run_cocotb(Line(), __name__, tmp_path, seed=seed)
