"""hdl.update.writer, as Verilog: the bounds of each node once, in order, and never its link."""

import gc
import os
import random

import cocotb
import pytest
from cocotb.triggers import FallingEdge, RisingEdge

from hdl import records
from hdl.isa import NODE_BITS
from hdl.update.writer import Writer
from tests.harness import CONFIGS, SideBySide, run_cocotb, unbuilt
from tests.memory import Memory
from tests.streams import now, start

UNITS = {  # configuration and slack
    "smallest": ("smallest", 2),
    "tiny": ("tiny", 2),
    "odd": ("odd", 0),
    "full": ("full", 2),
    "wide": ("wide", 15),
}


class Bench:
    """A writer, and a source of nodes that obeys `room` but has `slack` of them on their way."""

    def __init__(self, dut):
        self.dut, self.name = dut, os.environ["UNIT"]
        config, self.slack = UNITS[self.name]
        self.config = CONFIGS[config]
        writer = unbuilt(Writer(self.config, self.slack))
        self.layout = writer.i.payload.shape()
        self.bounds = records.bounds(self.config.fmt)
        self.sent: list[tuple[int, int]] = []  # node and bounds
        self.cycles: list[int] = []

    def port(self, name):
        return getattr(self.dut, f"{self.name}__{name}")

    async def begin(self, **timing) -> Memory:
        self.base = random.randrange(1 << self.config.address_bits)
        await start(
            self.dut,
            **{f"{self.name}__i__valid": 0, f"{self.name}__base": self.base},
            **{f"{self.name}__port__{port}": 0 for port in ("request__ready", "response__valid")},
        )
        self.memory = Memory(self.dut, f"{self.name}__port", self.config, {}, **timing)
        cocotb.start_soon(self.memory.run())
        return self.memory

    async def send(self, cycles: int, idle: float = 0.0):
        """Begin a node in each cycle with room: it comes `slack` cycles later, and is taken.

        Idle says just that all nodes that came have left.
        """
        valid, ready, room, idles, leaves, left = map(
            self.port,
            (
                "i__valid",
                "i__ready",
                "room",
                "idle",
                "port__request__valid",
                "port__request__ready",
            ),
        )
        pipeline: list[int | None] = [None] * self.slack
        waiting = 0
        for cycle in range(cycles + self.slack):
            await FallingEdge(self.dut.clk)  # of this cycle: room has settled
            begins = cycle < cycles and room.value and random.random() >= idle
            pipeline.append(self._node() if begins else None)
            comes = pipeline.pop(0)
            valid.value = comes is not None
            if comes is not None:
                self.port("i__payload").value = comes
            await RisingEdge(self.dut.clk)
            assert bool(idles.value) == (not waiting), f"idle with {waiting} waiting"
            waiting -= bool(leaves.value) and bool(left.value)
            if comes is not None:
                assert ready.value, f"room for {self.slack} more was promised"
                waiting += 1
                self.cycles.append(now())
        valid.value = 0

    def _node(self) -> int:
        """A random node to write."""
        node = random.randrange(1 << min(NODE_BITS, self.config.address_bits))
        bounds = random.getrandbits(self.bounds.size)
        self.sent.append((node, bounds))
        return node | bounds << self.layout["bounds"].offset

    async def finish(self):
        while len(self.memory.requests) < len(self.sent):
            await RisingEdge(self.dut.clk)
        for _ in range(5):
            await RisingEdge(self.dut.clk)
        assert self.port("idle").value
        mask = (1 << records.bound_bytes(self.config.fmt)) - 1
        wrap = 1 << self.config.address_bits
        found = [(r.address, r.write, r.mask, r.data) for r in self.memory.requests]
        assert found == [((self.base + k) % wrap, 1, mask, bits) for k, bits in self.sent]


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(busy=[0.0, 0.5, 0.9], idle=[0.0, 0.5])
async def writes_in_order(dut, busy, idle):
    bench = Bench(dut)
    await bench.begin(busy=busy)
    await bench.send(400, idle)
    await bench.finish()
    if not busy:
        assert [r.cycle for r in bench.memory.requests] == [c + 2 for c in bench.cycles]
    if not busy and not idle and bench.slack < Writer.depth - 1:
        assert len(bench.sent) == 400, "one a cycle"


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def room_for_all_that_is_promised(dut):
    bench = Bench(dut)
    memory = await bench.begin(period=1 << 30)  # takes nothing
    await bench.send(60)
    assert 0 <= len(bench.sent) - Writer.depth <= 2, "two are at the port"
    memory.period = 1
    await bench.finish()


@pytest.mark.parametrize("name", UNITS)
def test_contract(name, tmp_path, seed):
    units = SideBySide({
        name: Writer(CONFIGS[config], slack) for name, (config, slack) in UNITS.items()
    })
    run_cocotb(units, __name__, tmp_path, seed=seed, UNIT=name)


@pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
@pytest.mark.parametrize("slack", [-1, Writer.depth])
def test_slack_is_less_than_depth(slack):
    with pytest.raises(ValueError, match="slack"):
        Writer(CONFIGS["tiny"], slack)
    gc.collect()  # what the constructor gave up, while its warning is ignored
