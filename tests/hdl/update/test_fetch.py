"""hdl.update.fetch, as Verilog: every instruction once, in order, and no word too many."""

import os
import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.isa import INSTRUCTION_BITS
from hdl.records import instructions_per_word, word_bits
from hdl.update.fetch import BLOCK, Fetch, program
from tests.harness import CONFIGS, SideBySide, run_cocotb, unbuilt
from tests.memory import Memory
from tests.streams import now, put, start, take


def unit():
    """Name in the Verilog of the unit under test, and its configuration."""
    name = os.environ["CONFIG"]
    return name, CONFIGS[name]


def instructions(config, words, address: int, length: int) -> list[int]:
    """The instructions of a program in memory."""
    slots = instructions_per_word(config.fmt)
    mask = (1 << INSTRUCTION_BITS) - 1
    return [
        words[address + k // slots] >> k % slots * INSTRUCTION_BITS & mask for k in range(length)
    ]


async def begin(dut, config, name, programs, **timing) -> Memory:
    """Start, with a memory of random words where the programs are, and no others."""
    await start(
        dut,
        **{f"{name}__{port}": 0 for port in ("i__valid", "o__ready", "port__request__ready")},
        **{f"{name}__port__response__valid": 0},
    )
    slots = instructions_per_word(config.fmt)
    words = {
        address + k: random.getrandbits(word_bits(config.fmt))
        for address, length in programs
        for k in range(-(-length // slots))
    }
    memory = Memory(dut, f"{name}__port", config, words, **timing)
    cocotb.start_soon(memory.run())
    return memory


def pack_programs(config, programs) -> list[int]:
    layout = program(config)
    return [layout.const({"address": a, "length": n}).as_bits() for a, n in programs]


async def watch(dut, name, lengths):
    """A program is taken when all of the last one has been given; idle says just that."""
    i_valid, i_ready, o_valid, o_ready, idle = (
        getattr(dut, f"{name}__{port}")
        for port in ("i__valid", "i__ready", "o__valid", "o__ready", "idle")
    )
    left = 0
    lengths = iter(lengths)
    while True:
        await RisingEdge(dut.clk)
        assert bool(idle.value) == bool(i_ready.value) == (not left), f"{left} left to give"
        left -= bool(o_valid.value) and bool(o_ready.value)
        if i_valid.value and i_ready.value:
            left = next(lengths)


@cocotb.test(timeout_time=2, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 7], stalls=[0.0, 0.5])
async def gives_programs_back_to_back(dut, latency, stalls):
    name, config = unit()
    slots = instructions_per_word(config.fmt)
    most = 1 << config.address_bits
    longest = min(150, slots * (most - 1))
    lengths = [0, 1, 3, 4, 5, 0, 0, slots - 1, slots, slots + 1, 2 * slots, 1, 1, longest, 2]
    programs = [(random.randrange(most - -(-n // slots) + 1) % most, n) for n in lengths]
    programs.append((most - 2, 2 * slots))  # up to the last word of the memory
    lengths.append(2 * slots)
    memory = await begin(dut, config, name, programs, latency=latency, busy=stalls)
    expected = [x for p in programs for x in instructions(config, memory.words, *p)]
    cocotb.start_soon(watch(dut, name, lengths))
    source = cocotb.start_soon(put(dut, f"{name}__i", pack_programs(config, programs), stalls))
    found = await take(dut, f"{name}__o", sum(lengths), stalls)
    await source
    for _ in range(20 + latency):  # nothing comes after the last
        await RisingEdge(dut.clk)
        assert not getattr(dut, f"{name}__o__valid").value
    assert found == expected
    read = [(r.address, r.write) for r in memory.requests]
    assert read == [(a + k, 0) for a, n in programs for k in range(-(-n // slots))]


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(shared=[False, True])
async def sustains_one_a_cycle(dut, shared):
    name, config = unit()
    slots = instructions_per_word(config.fmt)
    length = slots * min(40, (1 << config.address_bits) - 1)
    memory = await begin(
        dut, config, name, [(1, length)],
        latency=config.latency, period=slots if shared else 1,
    )  # fmt: skip
    cocotb.start_soon(put(dut, f"{name}__i", pack_programs(config, [(1, length)])))
    cycles: list[int] = []
    found = await take(dut, f"{name}__o", length, cycles=cycles)
    assert found == instructions(config, memory.words, 1, length)
    assert cycles[0] == memory.responses[0] + 1
    assert cycles == list(range(cycles[0], cycles[0] + length))


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def asks_for_blocks_in_one_go(dut):
    name, config = unit()
    slots = instructions_per_word(config.fmt)
    words = min(60, (1 << config.address_bits) - 2)
    memory = await begin(dut, config, name, [(2, words * slots)])
    cocotb.start_soon(put(dut, f"{name}__i", pack_programs(config, [(2, words * slots)])))
    await take(dut, f"{name}__o", words * slots)
    for before, after in zip(memory.requests, memory.requests[1:], strict=False):
        if after.address % BLOCK:
            assert after.cycle == before.cycle + 1, f"word {after.address}"


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def reads_ahead_no_more_than_it_holds(dut):
    name, config = unit()
    slots = instructions_per_word(config.fmt)
    length = slots * min(100, (1 << config.address_bits) - 1)
    memory = await begin(dut, config, name, [(0, length)])
    cocotb.start_soon(put(dut, f"{name}__i", pack_programs(config, [(0, length)])))
    until = now() + 2 * length
    while now() < until:  # o takes nothing: responses are taken all the same
        await RisingEdge(dut.clk)
    asked = len(memory.requests)
    assert asked == len(memory.responses) <= unbuilt(Fetch(config)).depth + 1
    found = await take(dut, f"{name}__o", length)
    assert found == instructions(config, memory.words, 0, length)


@pytest.mark.parametrize("name", CONFIGS)
def test_contract(name, tmp_path, seed):
    units = SideBySide({name: Fetch(config) for name, config in CONFIGS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed, CONFIG=name)
