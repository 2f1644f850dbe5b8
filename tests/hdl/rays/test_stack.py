"""hdl.rays.stack, as Verilog, against lists: packets that push, pop and come from tests."""

import os
import random
from collections import deque

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from hdl.rays.stack import Stack
from sim.model.fp.order import from_key, order_key
from tests.harness import one_of, run_cocotb, unbuilt
from tests.hdl.fp.operands import weighted
from tests.payloads import leaves, pack
from tests.streams import now, start

CONFIGS = {
    "one": Config(FloatFormat(2, 1), packets=1, stack_depth=1),
    "small": Config(FloatFormat(3, 2), packets=3, stack_depth=5),
    "full": FULL,
}
PACKETS = 100
RAYS = 4
ROOT = 12345


class Bench:
    """Packets of a random life; `expected` has what each does next."""

    def __init__(self, dut, name: str, packets: int):
        self.dut, self.name, self.left = dut, name, packets
        self.config = CONFIGS[name]
        self.fmt = self.config.fmt
        self.unit = unbuilt(Stack(self.config))
        self.rng = np.random.default_rng(random.getrandbits(32))
        self.free = list(range(self.config.packets))
        self.stacks: dict[int, list] = {}  # of (child, is_leaf, intervals), in order keys
        self.best: dict[int, list[int]] = {}
        self.expected: dict[int, dict | None] = {}  # None: it is done
        self.actions: dict[int, deque] = {}  # ports and payloads to come, of each packet
        self.tests: deque[tuple[int, int]] = deque()
        self.popped = 0  # entries that have to be taken off
        self.dropped = 0

    def port(self, name: str):
        return getattr(self.dut, f"{self.name}__{name}")

    def pack(self, port: str, fields: dict) -> int:
        layout = getattr(self.unit, port).payload.shape()
        columns = {name: [fields.get(name, 0)] for name, _, _ in leaves(layout, self.fmt)}
        return pack(layout, self.fmt, columns)[0]

    def intervals(self) -> list[tuple[int, int]]:
        """Order keys; about a third of them empty in all rays."""
        keys = np.sort(order_key(self.fmt, weighted(self.fmt, self.rng, RAYS, 2)), axis=1)
        empty = self.rng.random(RAYS) < random.choice([0.0, 0.5, 0.97])
        keys[empty] = keys[empty, ::-1]
        return [tuple(row) for row in keys.tolist()]

    def patterns(self, intervals) -> dict[str, int]:
        keys = from_key(self.fmt, np.array(intervals)).tolist()
        return {
            f"intervals.{k}.{field}": keys[k][column]
            for k in range(RAYS)
            for column, field in enumerate(("near", "far"))
        }

    def expect(self, packet: int, entry=None):
        """What comes of an entry, or of the stack."""
        stack, best = self.stacks[packet], self.best[packet]
        while entry or stack:
            if not entry:
                entry = stack.pop()
                self.popped += 1
            child, is_leaf, intervals = entry
            cut = [(near, min(far, best[k])) for k, (near, far) in enumerate(intervals)]
            mask = sum(1 << k for k, (near, far) in enumerate(cut) if near <= far)
            if mask:
                fields = {"packet": packet, "depth": len(stack), "mask": mask}
                fields |= {"child": child, "is_leaf": is_leaf} | self.patterns(cut)
                self.expected[packet] = fields
                return
            self.dropped += 1
            entry = None
        self.expected[packet] = None

    def live(self, packet: int):
        """Push some children, then come from a dead end or from a test."""
        stack = self.stacks[packet]
        actions = self.actions[packet] = deque()
        for _ in range(random.choice([0, 0, 0, 1, 2, self.config.stack_depth])):
            if len(stack) == self.config.stack_depth:
                break
            entry = (random.getrandbits(28), random.getrandbits(1), self.intervals())
            stack.append(entry)
            visit = {"packet": packet, "depth": len(stack)}
            entry = {"child": entry[0], "is_leaf": entry[1]} | self.patterns(entry[2])
            push = self.pack("i_pushes", visit | entry)
            actions.append([("i_pushes", push), ("i_visits", self.pack("i_visits", visit))])
        if random.random() < 0.5:
            fields = {"packet": packet, "depth": len(stack)}
            actions.append([("i_pops", self.pack("i_pops", fields))])
        else:
            t = order_key(self.fmt, weighted(self.fmt, self.rng, RAYS, 1)[:, 0]).tolist()
            best = self.best[packet] = [
                min(old, new) if random.random() < 0.3 else old
                for old, new in zip(self.best[packet], t, strict=True)
            ]
            keys = from_key(self.fmt, np.array(best)).tolist()
            test = {"packet": packet} | {f"t.{k}": keys[k] for k in range(RAYS)}
            actions.append([("test", self.pack("i_tests", test))])
        self.expect(packet)

    async def step_side(self):
        """One action of a packet a cycle."""
        ports = ("i_pushes", "i_visits", "i_pops")
        while True:
            for port in ports:
                self.port(f"{port}__valid").value = 0
            able = [packet for packet, actions in self.actions.items() if actions]
            if able:
                for port, word in self.actions[random.choice(able)].popleft():
                    if port == "test":
                        self.tests.append((now(), word))
                    else:
                        self.port(f"{port}__payload").value = word
                        self.port(f"{port}__valid").value = 1
            await RisingEdge(self.dut.clk)

    async def test_side(self):
        valid, ready = self.port("i_tests__valid"), self.port("i_tests__ready")
        while True:
            if self.tests:
                valid.value = 1
                self.port("i_tests__payload").value = self.tests.popleft()[1]
                await RisingEdge(self.dut.clk)
                while not ready.value:
                    await RisingEdge(self.dut.clk)
                valid.value = 0
            else:
                await RisingEdge(self.dut.clk)

    async def start_side(self):
        valid, ready = self.port("i_start__valid"), self.port("i_start__ready")
        for _ in range(self.left):
            while not self.free:
                await RisingEdge(self.dut.clk)
            packet = self.free.pop(random.randrange(len(self.free)))
            intervals = self.intervals()
            self.stacks[packet] = []
            self.best[packet] = [far for _, far in intervals]
            self.expect(packet, (ROOT, 0, intervals))
            fields = {"packet": packet} | self.patterns(intervals)
            self.port("i_start__payload").value = self.pack("i_start", fields)
            valid.value = 1
            await RisingEdge(self.dut.clk)
            while not ready.value:
                await RisingEdge(self.dut.clk)
            valid.value = 0

    async def run(self, busy: float) -> int:
        """All packets; returns the entries taken off."""
        ports = ("i_start", "i_tests", "i_pops", "i_pushes", "i_visits")
        inputs = {f"{port}__valid": 0 for port in ports} | {"root": ROOT, "o_done__ready": 0}
        await start(self.dut, **{f"{self.name}__{k}": v for k, v in inputs.items()})
        sides = (self.step_side(), self.test_side(), self.start_side())
        tasks = [cocotb.start_soon(side) for side in sides]
        visits, visit = self.port("o_visits__valid"), self.port("o_visits__payload")
        done, packet_done = self.port("o_done__valid"), self.port("o_done__payload")
        popped = 0
        while self.left:
            willing = random.random() >= busy
            self.port("o_done__ready").value = willing
            await RisingEdge(self.dut.clk)
            popped += int(self.port("popped").value)
            if visits.value:
                word = visit.value.to_unsigned()
                packet = word & ((1 << len(self.unit.o_visits.p.packet)) - 1)
                want = self.expected.pop(packet)
                assert want and word == self.pack("o_visits", want), f"{word:x}, not {want}"
                self.live(packet)
            if done.value and willing:
                packet = int(packet_done.value)
                want = self.expected.pop(packet)
                assert want is None, f"packet {packet} is done, not at {want}"
                self.free.append(packet)
                self.left -= 1
        for task in tasks:
            task.cancel()
        return popped


@cocotb.test(timeout_time=3, timeout_unit="ms")
@cocotb.parametrize(busy=[0.0, 0.8])
async def equals_lists(dut, busy):
    bench = Bench(dut, os.environ["CONFIG"], PACKETS)
    assert await bench.run(busy) == bench.popped
    assert bench.popped > PACKETS // 3
    assert bench.dropped > PACKETS // 10


@pytest.mark.parametrize("name", CONFIGS)
def test_equals_lists(name, tmp_path, seed):
    run_cocotb(one_of(Stack, CONFIGS, name), __name__, tmp_path, seed=seed, CONFIG=name)
