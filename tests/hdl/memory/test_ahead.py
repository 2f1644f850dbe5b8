"""hdl.memory.ahead, as Verilog: the words of each span once, in blocks, as far ahead as it may."""

import gc
import os
import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.memory.ahead import Ahead, span
from hdl.records import word_bits
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.memory import Memory
from tests.streams import now, put, start, take

CONFIG = CONFIGS["tiny"]
SPAN = span(CONFIG)
UNITS = {  # depth, block
    "least": (2, 1),
    "uneven": (11, 4),
    "deep": (30, 8),
}


async def begin(dut, spans, **timing) -> tuple[str, Memory]:
    """Start, with a memory of random words where the spans are, and no others."""
    name = os.environ["UNIT"]
    inputs = ("i__valid", "o__ready", "port__request__ready", "port__response__valid")
    await start(dut, **{f"{name}__{port}": 0 for port in inputs})
    addresses = [address + k for address, words in spans for k in range(words)]
    words = {address: random.getrandbits(word_bits(CONFIG.fmt)) for address in addresses}
    memory = Memory(dut, f"{name}__port", CONFIG, words, **timing)
    cocotb.start_soon(memory.run())
    return name, memory


def pack(spans) -> list[int]:
    return [SPAN.const({"address": address, "words": words}).as_bits() for address, words in spans]


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 9], busy=[0.0, 0.5])
async def gives_spans_back_to_back(dut, latency, busy):
    spans = [(random.randrange(1000), words) for words in (0, 1, 2, 3, 8, 0, 0, 40, 1, 7, 33, 0, 5)]
    name, memory = await begin(dut, spans, latency=latency, busy=busy)
    addresses = [address + k for address, words in spans for k in range(words)]
    source = cocotb.start_soon(put(dut, f"{name}__i", pack(spans), busy))
    found = await take(dut, f"{name}__o", len(addresses), busy)
    await source
    for _ in range(20 + latency):
        await RisingEdge(dut.clk)
        assert not getattr(dut, f"{name}__o__valid").value, "nothing comes after the last"
    assert found == [memory.words[address] for address in addresses]
    assert [(r.address, r.write) for r in memory.requests] == [(k, 0) for k in addresses]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def asks_for_blocks_in_one_go(dut):
    _, block = UNITS[os.environ["UNIT"]]
    name, memory = await begin(dut, [(3, 60)])
    cocotb.start_soon(put(dut, f"{name}__i", pack([(3, 60)])))
    await take(dut, f"{name}__o", 60, busy=0.7)
    for before, after in zip(memory.requests, memory.requests[1:], strict=False):
        if after.address % block:
            assert after.cycle == before.cycle + 1, f"word {after.address}"


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def one_word_a_cycle_of_what_it_hides(dut):
    depth, block = UNITS[os.environ["UNIT"]]
    latency = depth - block - 4  # and 4 cycles from a place that is free to its word
    if latency < 1:
        return
    name, memory = await begin(dut, [(0, 64)], latency=latency)
    begun, cycles = now(), []
    cocotb.start_soon(put(dut, f"{name}__i", pack([(0, 64)])))
    await take(dut, f"{name}__o", 64, cycles=cycles)
    assert memory.requests[0].cycle == begun + 3, "2 cycles after the one in which it was taken"
    assert cycles[0] == memory.responses[0] + 1
    assert cycles == list(range(cycles[0], cycles[0] + 64))


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def reads_ahead_no_more_than_it_holds(dut):
    depth, block = UNITS[os.environ["UNIT"]]
    name, memory = await begin(dut, [(0, 100)])
    cocotb.start_soon(put(dut, f"{name}__i", pack([(0, 100)])))
    for _ in range(200):  # o takes nothing
        await RisingEdge(dut.clk)
    assert depth - block - 1 < len(memory.requests) == len(memory.responses) <= depth
    assert await take(dut, f"{name}__o", 100) == [memory.words[k] for k in range(100)]


@pytest.mark.parametrize("name", UNITS)
def test_contract(name, tmp_path, seed):
    units = SideBySide({
        name: Ahead(CONFIG, depth=depth, block=block) for name, (depth, block) in UNITS.items()
    })
    run_cocotb(units, __name__, tmp_path, seed=seed, UNIT=name)


@pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
@pytest.mark.parametrize(("depth", "block"), [(4, 4), (4, 0), (0, 1)])
def test_holds_more_than_a_block(depth, block):
    with pytest.raises(ValueError, match="more words than a block"):
        Ahead(CONFIG, depth=depth, block=block)
    gc.collect()  # what the constructor gave up, while its warning is ignored
