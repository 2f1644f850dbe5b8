"""hdl.memory.arbiter, as Verilog: what each client sees, and what the memory does."""

import gc
import os
import random
from collections import deque

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.memory.arbiter import Arbiter
from hdl.memory.port import request
from hdl.records import word_bits
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.memory import Memory, Request, written
from tests.payloads import unpack
from tests.streams import collect, now, put, start

CONFIG = CONFIGS["tiny"]
LAYOUT = request(CONFIG)
UNITS = {  # clients, outstanding
    "one": (1, 1),
    "three": (3, 4),
    "five": (5, 7),
}


def unit():
    """Name in the Verilog of the arbiter under test, its clients and outstanding."""
    name = os.environ["UNIT"]
    return name, *UNITS[name]


def traffic(client: int, clients: int, count: int, writes: float) -> list[int]:
    """Random requests of a client, to a few words that are its own."""
    bits = word_bits(CONFIG.fmt)
    return [
        LAYOUT.const({
            "address": clients * random.randrange(6) + client,
            "write": random.random() < writes,
            "mask": random.getrandbits(bits // 8),
            "data": random.getrandbits(bits),
        }).as_bits()
        for _ in range(count)
    ]


def replay(sent: list[int], words: dict[int, int]) -> list[int]:
    """What a client reads if its requests are done one after the other."""
    words, answers = dict(words), []
    for bits in sent:
        asked = Request(0, **unpack(LAYOUT, bits))
        if asked.write:
            words[asked.address] = written(words[asked.address], asked)
        else:
            answers.append(words[asked.address])
    return answers


class Monitor:
    """Watches who is served in each cycle: priority, and reads under way."""

    def __init__(self, dut):
        name, self.clients, self.outstanding = unit()

        def handles(port):
            parts = ("request__valid", "request__ready", "request__payload")
            parts += ("response__valid",)
            return [getattr(dut, f"{name}__{port}__{part}") for part in parts]

        self.ports = [handles(f"clients__{k}") for k in range(self.clients)]
        self.down = handles("port")
        self.dut = dut
        self.served: list[tuple[int, int]] = []  # client and payload
        self.most_under_way = 0
        self.blocked = 0  # cycles in which a read waited for those under way

    async def run(self):
        write_bit = 1 << LAYOUT["write"].offset
        readers: deque[int] = deque()  # clients of the reads under way
        under_way = held = 0  # reads; requests served that are not taken
        came = False  # a response in the cycle before
        while True:
            await RisingEdge(self.dut.clk)
            free = held < 2
            held -= bool(self.down[0].value and self.down[1].value)
            full = under_way == self.outstanding
            answered = [k for k, port in enumerate(self.ports) if port[3].value]
            assert len(answered) == came, f"clients {answered} have one response"
            if answered:
                assert readers.popleft() == answered[0], "a response of another client"
            came = bool(self.down[3].value)
            under_way -= came
            winner, taken = None, []
            for k, (valid, ready, payload, _) in enumerate(self.ports):
                if not valid.value:
                    continue
                bits = payload.value.to_unsigned()
                blocked = full
                self.blocked += blocked
                if winner is None and free and not blocked:
                    winner = k
                if ready.value:
                    taken.append(k)
                    self.served.append((k, bits))
                    held += 1
                    if not bits & write_bit:
                        readers.append(k)
                        under_way += 1
            assert taken == [k for k in [winner] if k is not None], f"served {taken}, not {winner}"
            self.most_under_way = max(self.most_under_way, under_way)
            assert under_way <= self.outstanding


async def begin(dut, **memory):
    """Start with a memory of random words and a monitor."""
    name, clients, _ = unit()
    inputs = {f"{name}__port__request__ready": 0, f"{name}__port__response__valid": 0}
    for k in range(clients):
        inputs[f"{name}__clients__{k}__request__valid"] = 0
    await start(dut, **inputs)
    words = {address: random.getrandbits(word_bits(CONFIG.fmt)) for address in range(6 * clients)}
    memory = Memory(dut, f"{name}__port", CONFIG, words, **memory)
    monitor = Monitor(dut)
    cocotb.start_soon(memory.run())
    cocotb.start_soon(monitor.run())
    return memory, monitor


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 9], busy=[0.0, 0.5], idle=[0.0, 0.5])
async def all_requests_are_done_in_order(dut, latency, busy, idle):
    name, clients, outstanding = unit()
    memory, monitor = await begin(dut, latency=latency, busy=busy)
    before = dict(memory.words)
    sent = [traffic(k, clients, 100, writes=0.4) for k in range(clients)]
    expected = [replay(sent[k], before) for k in range(clients)]
    for k in range(clients):
        cocotb.start_soon(put(dut, f"{name}__clients__{k}__request", sent[k], idle))
    takers = [
        cocotb.start_soon(collect(dut, f"{name}__clients__{k}__response", len(expected[k])))
        for k in range(clients)
    ]
    for taker in takers:
        await taker
    while len(memory.requests) < 100 * clients:  # writes have no response
        await RisingEdge(dut.clk)

    for k, taker in enumerate(takers):
        assert taker.result() == expected[k], f"responses of client {k}"
        assert [bits for client, bits in monitor.served if client == k] == sent[k]
    done = [(r.address, r.write, r.mask, r.data) for r in memory.requests]
    assert done == [tuple(unpack(LAYOUT, bits).values()) for _, bits in monitor.served]
    if latency > outstanding and not idle:
        assert monitor.most_under_way == outstanding
        assert monitor.blocked


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(writes=[0.0, 1.0])
async def one_request_a_cycle(dut, writes):
    name, clients, outstanding = unit()
    if not writes and outstanding < 3:
        return  # a read is under way for three cycles
    memory, _ = await begin(dut)
    first = now()
    for k in range(clients):
        sent = traffic(k, clients, 50, writes)
        cocotb.start_soon(put(dut, f"{name}__clients__{k}__request", sent))
    while len(memory.requests) < 50 * clients:
        await RisingEdge(dut.clk)
    cycles = [r.cycle for r in memory.requests]
    assert cycles == list(range(first + 2, first + 2 + 50 * clients)), "a request takes one cycle"
    owners = [r.address % clients for r in memory.requests]
    assert owners == sorted(owners), "the lowest index first"


@pytest.mark.parametrize("name", UNITS)
def test_contract(name, tmp_path, seed):
    units = SideBySide({name: Arbiter(CONFIG, *unit) for name, unit in UNITS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed, UNIT=name)


@pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
@pytest.mark.parametrize(("clients", "outstanding"), [(0, 1), (1, 0)])
def test_needs_one_of_each(clients, outstanding):
    with pytest.raises(ValueError, match="at least one"):
        Arbiter(CONFIG, clients, outstanding)
    gc.collect()  # what the constructor gave up, while its warning is ignored
