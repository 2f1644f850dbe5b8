"""The clock, and both ends of streams under cocotb."""

import random

from cocotb.clock import Clock
from cocotb.simtime import get_sim_time
from cocotb.triggers import RisingEdge

CYCLE = 10  # ns


def now() -> int:
    """Cycles since the clock began."""
    return int(get_sim_time("ns")) // CYCLE


async def start(dut, **inputs: int):
    """Start the clock, set inputs, and leave reset."""
    for name, value in inputs.items():
        getattr(dut, name).value = value
    dut.rst.value = 1
    Clock(dut.clk, CYCLE, unit="ns", impl="gpi").start()
    for _ in range(2):  # one edge is not enough for Icarus under a gpi clock
        await RisingEdge(dut.clk)
    dut.rst.value = 0


async def put(dut, name: str, payloads, idle: float = 0.0):
    """Send payloads into a stream, with gaps in a part `idle` of the cycles; never waits to offer.

    Ends at the edge at which the last one is taken.
    """
    valid, payload = getattr(dut, f"{name}__valid"), getattr(dut, f"{name}__payload")
    ready = getattr(dut, f"{name}__ready")
    for word in payloads:
        while random.random() < idle:
            valid.value = 0
            await RisingEdge(dut.clk)
        valid.value = 1
        payload.value = word
        await RisingEdge(dut.clk)
        while not ready.value:
            await RisingEdge(dut.clk)
    valid.value = 0


async def take(
    dut, name: str, count: int, busy: float = 0.0, cycles: list | None = None
) -> list[int]:
    """The next `count` payloads of a stream; the stream's rules are checked.

    A busy taker is ready only after it has seen valid, and then in a part 1 - `busy` of the
    cycles; what waits has to stay as it is. `cycles` gets the cycle of each payload.
    """
    valid, payload = getattr(dut, f"{name}__valid"), getattr(dut, f"{name}__payload")
    ready = getattr(dut, f"{name}__ready")
    words: list[int] = []
    willing = not busy
    waiting = None
    while len(words) < count:
        ready.value = willing
        await RisingEdge(dut.clk)
        if not valid.value:
            assert waiting is None, f"{name}: valid was withdrawn"
            willing = not busy
            continue
        word = payload.value.to_unsigned()
        assert waiting in (None, word), f"{name}: payload {waiting:x} became {word:x} as it waited"
        waiting = None if willing else word
        if willing:
            words.append(word)
            if cycles is not None:
                cycles.append(now())
        willing = random.random() >= busy
    ready.value = 0
    return words


async def collect(dut, name: str, count: int, cycles: list | None = None) -> list[int]:
    """The next `count` payloads of a stream that is taken at once, as `take` gives them."""
    valid, payload = getattr(dut, f"{name}__valid"), getattr(dut, f"{name}__payload")
    words: list[int] = []
    while len(words) < count:
        await RisingEdge(dut.clk)
        if valid.value:
            words.append(payload.value.to_unsigned())
            if cycles is not None:
                cycles.append(now())
    return words
