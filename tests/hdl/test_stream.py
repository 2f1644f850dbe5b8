"""hdl.stream: a slice gives what it takes, at once or with waits on both sides."""

import random

import cocotb
from cocotb.triggers import RisingEdge, Timer

from hdl.stream import Slice
from tests.harness import run_cocotb
from tests.streams import now, put, start, take

WIDTH = 8


@cocotb.test()
async def keeps_what_it_takes(dut):
    words = [random.getrandbits(WIDTH) for _ in range(500)]
    await start(dut, i__valid=0, o__ready=0)
    for idle, busy in [(0, 0), (0.5, 0), (0, 0.5), (0.5, 0.5), (0, 0.9)]:
        sending = cocotb.start_soon(put(dut, "i", words, idle))
        assert await take(dut, "o", len(words), busy) == words
        await sending


@cocotb.test()
async def takes_one_cycle_and_one_a_cycle(dut):
    await start(dut, i__valid=0, o__ready=0)
    cycles: list[int] = []
    begin = now()
    sending = cocotb.start_soon(put(dut, "i", range(50)))
    await take(dut, "o", 50, cycles=cycles)
    assert cycles == list(range(begin + 2, begin + 52))
    await sending


@cocotb.test()
async def nothing_passes_within_a_cycle(dut):
    """Ready does not follow o.ready, nor valid i.valid, before the next edge."""
    await start(dut, i__valid=1, o__ready=0)
    for _ in range(4):
        await RisingEdge(dut.clk)
    await Timer(1, "ns")
    assert (dut.i__ready.value, dut.o__valid.value) == (0, 1)  # it holds two
    dut.o__ready.value = 1
    await Timer(1, "ns")
    assert dut.i__ready.value == 0


def test_contract(tmp_path, seed):
    run_cocotb(Slice(WIDTH), __name__, tmp_path, seed=seed)
