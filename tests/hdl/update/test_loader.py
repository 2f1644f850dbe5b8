"""hdl.update.loader, as Verilog: each vertex to its register, in order, within its limits."""

import os
import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl import records
from hdl.records import word_bits
from hdl.update.loader import Loader
from tests.harness import CONFIGS, SideBySide, run_cocotb, unbuilt
from tests.memory import Memory
from tests.payloads import difference
from tests.streams import now, put, start

NAMES = ("smallest", "tiny", "odd", "full", "wide")


class Bench:
    """A loader at work: what went in and came out, and when."""

    def __init__(self, dut):
        self.name = os.environ["CONFIG"]
        self.config = CONFIGS[self.name]
        self.dut = dut
        loader = unbuilt(Loader(self.config))
        self.i_layout, self.o_layout = loader.i.payload.shape(), loader.o.payload.shape()
        self.entered: list[int] = []  # cycles
        self.left: list[int] = []
        self.found: list[int] = []

    async def begin(self, **timing) -> Memory:
        config = self.config
        self.base = random.randrange(1 << config.address_bits)
        self.size = min(1 << config.address_bits, 200)
        await start(
            self.dut,
            **{f"{self.name}__i__valid": 0, f"{self.name}__base": self.base},
            **{f"{self.name}__port__{port}": 0 for port in ("request__ready", "response__valid")},
        )
        wrap = 1 << config.address_bits
        words = {
            (self.base + k) % wrap: random.getrandbits(word_bits(config.fmt))
            for k in range(self.size)
        }
        self.memory = Memory(self.dut, f"{self.name}__port", config, words, **timing)
        cocotb.start_soon(self.memory.run())
        cocotb.start_soon(self._watch())
        return self.memory

    def loads(self, count: int) -> list[tuple[int, int]]:
        """Random loads: register and vertex."""
        return [
            (random.randrange(self.config.vertex_registers), random.randrange(self.size))
            for _ in range(count)
        ]

    async def put(self, loads, idle=0.0):
        payloads = [self.i_layout.const({"v": v, "vertex": k}).as_bits() for v, k in loads]
        await put(self.dut, f"{self.name}__i", payloads, idle)

    async def put_within_registers(self, loads, idle=0.0):
        """Send loads, no more of them under way than there are registers."""
        for count, one in enumerate(loads):
            while count - len(self.left) >= self.config.vertex_registers:
                await RisingEdge(self.dut.clk)
            await self.put([one], idle)

    async def _watch(self):
        """Idle says just that no load is under way."""
        i_valid, i_ready, o_valid, o, idle = (
            getattr(self.dut, f"{self.name}__{port}")
            for port in ("i__valid", "i__ready", "o__valid", "o__payload", "idle")
        )
        while True:
            await RisingEdge(self.dut.clk)
            under_way = len(self.entered) - len(self.left)
            assert bool(idle.value) == (not under_way), f"idle with {under_way} under way"
            if o_valid.value:
                assert under_way, "a vertex that no one asked for"
                self.left.append(now())
                self.found.append(o.value.to_unsigned())
            if i_valid.value and i_ready.value:
                self.entered.append(now())

    def expected(self, loads) -> list[int]:
        mask = (1 << records.vertex(self.config.fmt).size) - 1
        return [
            v | (self.memory.words[self._address(k)] & mask) << self.o_layout["vertex"].offset
            for v, k in loads
        ]

    def _address(self, vertex: int) -> int:
        return (self.base + vertex) % (1 << self.config.address_bits)

    async def finish(self, loads):
        """Wait for all vertices, and check them and what was read."""
        while len(self.found) < len(loads):
            await RisingEdge(self.dut.clk)
        for _ in range(5):
            await RisingEdge(self.dut.clk)
        fmt = self.config.fmt
        for k, (got, want) in enumerate(zip(self.found, self.expected(loads), strict=True)):
            assert got == want, f"load {k}: {difference(fmt, self.o_layout, got, want)}"
        read = [(r.address, r.write) for r in self.memory.requests]
        assert read == [(self._address(vertex), 0) for _, vertex in loads]


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 6, 80], busy=[0.0, 0.5], idle=[0.0, 0.4])
async def loads_in_order(dut, latency, busy, idle):
    bench = Bench(dut)
    memory = await bench.begin(latency=latency, busy=busy)
    loads = bench.loads(150)
    await bench.put_within_registers(loads, idle)
    await bench.finish(loads)
    assert memory.most_under_way <= bench.config.vertex_registers
    if latency == 80 and not busy and not idle:
        assert memory.most_under_way == bench.config.vertex_registers


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def latency_and_rate(dut):
    bench = Bench(dut)
    latency = bench.config.vertex_registers - 2  # the longest that so many registers hide
    await bench.begin(latency=latency)
    loads = bench.loads(100)
    await bench.put(loads)
    await bench.finish(loads)
    assert bench.entered == list(range(bench.entered[0], bench.entered[0] + 100))
    # In by the edge of one cycle, asked in the next; out as the memory answers, in a register by
    # the edge of that cycle.
    assert [b - a for a, b in zip(bench.entered, bench.left, strict=True)] == [1 + latency] * 100


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def two_wait_for_the_port(dut):
    bench = Bench(dut)
    memory = await bench.begin(period=1 << 30)  # takes nothing
    loads = bench.loads(40)
    cocotb.start_soon(bench.put_within_registers(loads))
    for _ in range(100):
        await RisingEdge(dut.clk)
    assert len(bench.entered) == 2
    memory.period = 1
    await bench.finish(loads)


@pytest.mark.parametrize("name", NAMES)
def test_contract(name, tmp_path, seed):
    units = SideBySide({name: Loader(CONFIGS[name]) for name in NAMES})
    run_cocotb(units, __name__, tmp_path, seed=seed, CONFIG=name)
