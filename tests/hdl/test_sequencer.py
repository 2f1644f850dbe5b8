"""hdl.sequencer, as Verilog: one job at each start, and after it the bytes of some words."""

import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.core import frame_job
from hdl.records import word_bits
from hdl.sequencer import Sequencer
from tests.harness import CONFIGS, run_cocotb
from tests.memory import Memory
from tests.streams import start, take

CONFIG = CONFIGS["tiny"]
JOB = (1 << len(frame_job(CONFIG).const(None).as_value()) - 1) | 5
FIRST, COUNT = 9, 4


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 7], busy=[0.0, 0.7])
async def a_job_then_its_words(dut, latency, busy):
    await start(dut, start=0, core_busy=0, o_job__ready=0, o__ready=0)
    size = word_bits(CONFIG.fmt) // 8
    words = {k: random.getrandbits(8 * size) for k in range(FIRST, FIRST + COUNT)}
    memory = Memory(dut, "port", CONFIG, words, latency=latency, busy=busy)
    cocotb.start_soon(memory.run())
    expected = b"".join(words[k].to_bytes(size, "little") for k in range(FIRST, FIRST + COUNT))
    for frame in range(3):
        assert not (dut.running.value or dut.giving.value)
        dut.start.value = 1
        assert await take(dut, "o_job", 1) == [JOB]
        dut.core_busy.value = 1
        for _ in range(20):
            await RisingEdge(dut.clk)
            assert dut.running.value and not dut.giving.value and not dut.o_job__valid.value
            assert len(memory.requests) == frame * COUNT, "nothing is read while the core works"
        dut.core_busy.value = 0
        assert bytes(await take(dut, "o", len(expected), busy)) == expected
        dut.start.value = 0
        for _ in range(5):
            await RisingEdge(dut.clk)
        assert int(dut.frames.value) == frame + 1
        dut.start.value = 0


def test_contract(tmp_path, seed):
    unit = Sequencer(CONFIG, job=JOB, first=FIRST, count=COUNT)
    run_cocotb(unit, __name__, tmp_path, seed=seed)


@pytest.mark.parametrize(("first", "count"), [(0, 0), (-1, 2), (4090, 7)])
def test_words_that_are_none(first, count):
    with pytest.raises(ValueError, match="words"):
        Sequencer(CONFIG, job=0, first=first, count=count)
