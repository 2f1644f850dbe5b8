"""hdl.memory.gate, as Verilog: open it is not there, shut nothing passes."""

import random

import cocotb
import pytest
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import Out
from cocotb.triggers import RisingEdge

from hdl.memory.arbiter import Arbiter
from hdl.memory.gate import Gate
from hdl.memory.port import Port, request
from hdl.records import word_bits
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.memory import Memory, written
from tests.streams import collect, now, put, start

CONFIG = CONFIGS["tiny"]
LAYOUT = request(CONFIG)
OUTSTANDING = 5
WORDS = 20


class Gated(wiring.Component):
    """A gate before an arbiter, whose port is all that a memory sees."""

    def __init__(self):
        self.gate = Gate(CONFIG, OUTSTANDING)
        self.arbiter = Arbiter(CONFIG, clients=1, outstanding=64)
        ports = {name: self.gate.signature.members[name] for name in ("client", "shut", "idle")}
        super().__init__({**ports, "port": Out(Port(CONFIG))})

    def elaborate(self, platform):
        m = Module()
        m.submodules.gate, m.submodules.arbiter = gate, arbiter = self.gate, self.arbiter
        wiring.connect(m, wiring.flipped(self.client), gate.client)
        wiring.connect(m, gate.port, arbiter.clients[0])
        wiring.connect(m, arbiter.port, wiring.flipped(self.port))
        m.d.comb += [gate.shut.eq(self.shut), self.idle.eq(gate.idle)]
        return m


def payloads(count: int, writes: float) -> list[int]:
    """Random requests."""
    bits = word_bits(CONFIG.fmt)
    return [
        LAYOUT.const({
            "address": random.randrange(WORDS),
            "write": random.random() < writes,
            "mask": random.getrandbits(bits // 8),
            "data": random.getrandbits(bits),
        }).as_bits()
        for _ in range(count)
    ]


async def begin(dut, **memory) -> Memory:
    await start(dut, gate__client__request__valid=0, gate__shut=0, gate__port__response__valid=0)
    words = {address: random.getrandbits(word_bits(CONFIG.fmt)) for address in range(WORDS)}
    found = Memory(dut, "gate__port", CONFIG, words, **memory)
    cocotb.start_soon(found.run())
    return found


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize((("latency", "busy"), [(1, 0.0), (3, 0.5), (30, 0.0)]))
async def open_it_is_not_there(dut, latency, busy):
    memory = await begin(dut, latency=latency, busy=busy)
    words, expected = dict(memory.words), []
    sent = payloads(300, writes=0.3)
    for bits in sent:
        asked = LAYOUT.from_bits(bits)
        if asked.write:
            words[asked.address] = written(words[asked.address], asked)
        else:
            expected.append(words[asked.address])
    cocotb.start_soon(put(dut, "gate__client__request", sent, busy))
    assert await collect(dut, "gate__client__response", len(expected)) == expected
    assert memory.most_under_way <= OUTSTANDING
    assert latency < OUTSTANDING or memory.most_under_way == OUTSTANDING


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_request_a_cycle(dut):
    memory = await begin(dut, latency=2)
    cocotb.start_soon(put(dut, "gate__client__request", payloads(50, writes=0.0)))
    await collect(dut, "gate__client__response", 50)
    cycles = [asked.cycle for asked in memory.requests]
    assert cycles == list(range(cycles[0], cycles[0] + 50))


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 2, 9, 40])
async def shut_nothing_passes_and_idle_is_true(dut, latency):
    memory = await begin(dut, latency=latency, busy=0.3)
    for _ in range(20):
        sending = cocotb.start_soon(put(dut, "gate__client__request", payloads(30, writes=0.2)))
        for _ in range(random.randrange(40)):
            await RisingEdge(dut.clk)
        dut.gate__shut.value = 1
        await RisingEdge(dut.clk)
        sending.cancel()
        dut.gate__client__request__valid.value = 1  # in vain
        asked = len(memory.requests)
        for _ in range(3):  # the arbiter has a request or two, and an answer
            await RisingEdge(dut.clk)
        while not dut.gate__idle.value:
            await RisingEdge(dut.clk)
            assert not dut.gate__client__response__valid.value
        assert len(memory.requests) <= asked + 2
        assert len(memory.responses) == sum(not r.write for r in memory.requests)
        dut.gate__client__request__valid.value = 0
        dut.gate__shut.value = 0
        await RisingEdge(dut.clk)
        begun = now()
        cocotb.start_soon(
            put(dut, "gate__client__request", [LAYOUT.const({"address": 3}).as_bits()])
        )
        assert await collect(dut, "gate__client__response", 1) == [memory.words[3]]
        assert now() - begun < 40 + 3 * latency


def test_contract(tmp_path, seed):
    run_cocotb(SideBySide({"gate": Gated()}), __name__, tmp_path, seed=seed)


def test_no_reads_are_none():
    with pytest.raises(ValueError, match="not 0"):
        Gate(CONFIG, 0)
