"""hdl.memory.onchip, as Verilog: a memory is what was written to it, two cycles later."""

import os
import random

import cocotb
import pytest

from hdl.memory.onchip import OnChip
from hdl.memory.port import request
from hdl.records import word_bits
from tests.harness import CONFIGS, one_of, run_cocotb
from tests.memory import Request, written
from tests.payloads import unpack
from tests.streams import collect, now, put, start

NAMES = ("tiny", "odd", "wide")
WORDS = 48


def unit(name: str) -> OnChip:
    return OnChip(CONFIGS[name], words=WORDS)


async def begin(dut) -> tuple[str, dict]:
    """Start; the port's name, and the layout of a request."""
    name = os.environ["UNIT"]
    await start(dut, **{f"{name}__port__request__valid": 0})
    return f"{name}__port", request(CONFIGS[name])


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def begins_with_zeros(dut):
    """The first test of a run: no one has written yet."""
    port, layout = await begin(dut)
    sent = [layout.const({"address": k}).as_bits() for k in range(WORDS)]
    cocotb.start_soon(put(dut, f"{port}__request", sent))
    assert await collect(dut, f"{port}__response", WORDS) == [0] * WORDS


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(idle=[0.0, 0.5])
async def all_requests_are_done_in_order(dut, idle):
    port, layout = await begin(dut)
    memory, sent, expected = {}, [], []
    bits = word_bits(CONFIGS[os.environ["UNIT"]].fmt)
    # The memory stays as it is between tests: all words are written before they are read.
    for k in range(WORDS + 300):
        fields = {
            "address": k if k < WORDS else random.randrange(WORDS),
            "write": k < WORDS or random.random() < 0.5,
            "mask": -1 if k < WORDS else random.getrandbits(bits // 8),
            "data": random.getrandbits(bits),
        }
        fields["mask"] &= (1 << bits // 8) - 1
        sent.append(layout.const(fields).as_bits())
        asked = Request(0, **unpack(layout, sent[-1]))
        if asked.write:
            memory[asked.address] = written(memory.get(asked.address, 0), asked)
        else:
            expected.append(memory[asked.address])
    sending = cocotb.start_soon(put(dut, f"{port}__request", sent, idle))
    assert await collect(dut, f"{port}__response", len(expected)) == expected
    await sending


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def two_cycles_and_one_request_a_cycle(dut):
    port, layout = await begin(dut)
    sent = [layout.const({"address": k}).as_bits() for k in range(WORDS)]
    begun, cycles = now(), []
    sending = cocotb.start_soon(put(dut, f"{port}__request", sent))
    await collect(dut, f"{port}__response", WORDS, cycles=cycles)
    await sending
    # offered after the edge `begun`, taken at the next one
    assert cycles == list(range(begun + 1 + OnChip.latency, begun + 1 + OnChip.latency + WORDS))


@pytest.mark.parametrize("name", NAMES)
def test_contract(name, tmp_path, seed):
    parameters = {name: name for name in NAMES}
    run_cocotb(one_of(unit, parameters, name), __name__, tmp_path, seed=seed, UNIT=name)


@pytest.mark.parametrize("words", [1, 1 << 13])
def test_sizes_that_are_none(words):
    with pytest.raises(ValueError, match="words"):
        OnChip(CONFIGS["tiny"], words=words)
