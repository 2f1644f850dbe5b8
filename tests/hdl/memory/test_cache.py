"""hdl.memory.cache, as Verilog: every word right, hits overtake misses, nothing is lost."""

import random
from collections import Counter

import cocotb
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hdl.memory.cache import Cache
from hdl.records import word_bits
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.memory import Memory
from tests.streams import collect, now, put, start

CONFIG = CONFIGS["tiny"]
WORDS, TAGS, MISSES = 16, 8, 4
BITS = word_bits(CONFIG.fmt)
TAG_BITS = (TAGS - 1).bit_length()


def request(tag: int, address: int) -> int:
    return tag | address << TAG_BITS


async def begin(dut, **timing) -> Memory:
    inputs = ("cache__clear", "cache__reads__request__valid")
    ports = ("cache__port__request__ready", "cache__port__response__valid")
    await start(dut, **dict.fromkeys(inputs + ports, 0))
    words = {k: random.getrandbits(BITS) for k in range(1 << CONFIG.address_bits)}
    memory = Memory(dut, "cache__port", CONFIG, words, **timing)
    cocotb.start_soon(memory.run())
    return memory


def check(memory: Memory, asked, answers):
    """Each request has its answer: right tag, right word."""
    wanted = Counter((tag, memory.words[address]) for tag, address in asked)
    found = Counter((bits & (TAGS - 1), bits >> TAG_BITS) for bits in answers)
    address = {word: k for k, word in memory.words.items()}
    lost = [(tag, address[word]) for tag, word in (wanted - found).elements()]
    extra = [(tag, address.get(word, hex(word))) for tag, word in (found - wanted).elements()]
    assert not lost and not extra, f"lost (tag, address) {lost}, instead {extra}"


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(idle=[0.0, 0.4], busy=[0.0, 0.5], spread=[12, 40, 4096])
async def every_word_is_right(dut, idle, busy, spread):
    count = 400
    asked = [(random.randrange(TAGS), random.randrange(spread)) for _ in range(count)]
    memory = await begin(dut, latency=random.randint(1, 40), busy=busy)
    cocotb.start_soon(put(dut, "cache__reads__request", [request(*one) for one in asked], idle))
    check(memory, asked, await collect(dut, "cache__reads__response", count))
    await RisingEdge(dut.clk)
    hits, misses = int(dut.cache__hits.value), int(dut.cache__misses.value)
    assert misses == len(memory.requests) and hits + misses == count
    assert memory.most_under_way <= MISSES
    if spread > 1000:
        assert misses > 0.9 * count


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def hits_take_their_latency_one_a_cycle(dut):
    memory = await begin(dut)
    asked = [(k % TAGS, k) for k in range(WORDS)]
    cocotb.start_soon(put(dut, "cache__reads__request", [request(*one) for one in asked]))
    await collect(dut, "cache__reads__response", WORDS)
    cycles: list[int] = []
    first = now()
    cocotb.start_soon(put(dut, "cache__reads__request", [request(*one) for one in 3 * asked]))
    answers = await collect(dut, "cache__reads__response", 3 * WORDS, cycles=cycles)
    check(memory, 3 * asked, answers)
    assert cycles == list(range(first + 1 + Cache.latency, first + 1 + Cache.latency + 3 * WORDS))
    assert len(memory.requests) == WORDS


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_hit_overtakes_a_miss(dut):
    memory = await begin(dut, latency=50)
    await put(dut, "cache__reads__request", [request(0, 3)])
    await collect(dut, "cache__reads__response", 1)
    asked = [(1, 100), (2, 3), (3, 101), (4, 3)]
    cocotb.start_soon(put(dut, "cache__reads__request", [request(*one) for one in asked]))
    answers = await collect(dut, "cache__reads__response", 4)
    check(memory, asked, answers)
    assert [bits & (TAGS - 1) for bits in answers] == [2, 4, 1, 3]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def clear_forgets(dut):
    memory = await begin(dut)
    asked = [(k % TAGS, k) for k in range(WORDS)]
    for _ in range(2):
        cocotb.start_soon(put(dut, "cache__reads__request", [request(*one) for one in asked]))
        check(memory, asked, await collect(dut, "cache__reads__response", WORDS))
        for address in memory.words:
            memory.words[address] ^= 1
        dut.cache__clear.value = 1
        await RisingEdge(dut.clk)
        dut.cache__clear.value = 0
        await ClockCycles(dut.clk, 2)
        assert dut.cache__hits.value == 0 and dut.cache__misses.value == 0
    assert len(memory.requests) == 2 * WORDS


def test_cache(tmp_path, seed):
    cache = Cache(CONFIG, words=WORDS, tags=TAGS, misses=MISSES)
    run_cocotb(SideBySide({"cache": cache}), __name__, tmp_path, seed=seed)


@pytest.mark.parametrize("words", [0, 1, 3, 1 << 13])
def test_refuses_odd_sizes(words):
    with pytest.raises(ValueError, match="power of two"):
        Cache(CONFIG, words=words, tags=1, misses=1)
