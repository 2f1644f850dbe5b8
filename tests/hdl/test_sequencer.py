"""hdl.sequencer, as Verilog: one job at each start, and after it the bytes of some words."""

import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.core import frame_job
from hdl.records import word_bits
from hdl.sequencer import Sequencer
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.memory import Memory
from tests.streams import start, take

CONFIG = CONFIGS["tiny"]
JOB = (1 << len(frame_job(CONFIG).const(None).as_value()) - 1) | 5
FIRST, COUNT = 9, 4


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 7], busy=[0.0, 0.7])
async def a_job_then_its_words(dut, latency, busy):
    inputs = ("start", "core_busy", "o_job__ready", "o__ready")
    await start(dut, **{f"unit__{name}": 0 for name in inputs})
    size = word_bits(CONFIG.fmt) // 8
    words = {k: random.getrandbits(8 * size) for k in range(FIRST, FIRST + COUNT)}
    memory = Memory(dut, "unit__port", CONFIG, words, latency=latency, busy=busy)
    cocotb.start_soon(memory.run())
    expected = b"".join(words[k].to_bytes(size, "little") for k in range(FIRST, FIRST + COUNT))
    for frame in range(3):
        assert not (dut.unit__running.value or dut.unit__giving.value)
        dut.unit__start.value = 1
        assert await take(dut, "unit__o_job", 1) == [JOB]
        dut.unit__core_busy.value = 1
        for _ in range(20):
            await RisingEdge(dut.clk)
            assert dut.unit__running.value and not dut.unit__giving.value
            assert not dut.unit__o_job__valid.value
            assert len(memory.requests) == frame * COUNT, "nothing is read while the core works"
        dut.unit__core_busy.value = 0
        assert bytes(await take(dut, "unit__o", len(expected), busy)) == expected
        dut.unit__start.value = 0
        for _ in range(5):
            await RisingEdge(dut.clk)
        assert int(dut.unit__frames.value) == frame + 1
        dut.unit__start.value = 0


def test_contract(tmp_path, seed):
    unit = Sequencer(CONFIG, job=JOB, first=FIRST, count=COUNT)
    run_cocotb(SideBySide({"unit": unit}), __name__, tmp_path, seed=seed)


@pytest.mark.parametrize(("first", "count"), [(0, 0), (-1, 2), (4090, 7)])
def test_words_that_are_none(first, count):
    with pytest.raises(ValueError, match="words"):
        Sequencer(CONFIG, job=0, first=first, count=count)
