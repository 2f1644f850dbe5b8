"""hdl.rays.tester, as Verilog: the hits and answers of sim.model, at any timing of the memory."""

import os
import random

import cocotb
import numpy as np
import pytest
from cocotb.queue import Queue
from cocotb.triggers import RisingEdge

from hdl import records
from hdl.config import Config
from hdl.fp.format import FloatFormat
from hdl.rays import tester  # pytest would collect a Tester
from hdl.rays.packet import NO_TRIANGLE, RAYS
from sim.cosim.verilate import simulator
from sim.model.fp.format import encode
from sim.model.fp.order import order_key
from sim.model.rays.overflow import no_overflows
from sim.model.rays.setup import AXIS_Z, ORIGIN, SHEAR_X, setup
from sim.model.rays.triangle import intersect_bits
from tests.harness import one_of, run_cocotb, unbuilt
from tests.hdl.rays.triangles import grid
from tests.payloads import leaves, pack
from tests.streams import now, put, start, take

CONFIGS = {
    "one": Config(FloatFormat(2, 1), packets=1, address_bits=8, cache_words=16),
    "twelve": Config(FloatFormat(3, 3), packets=12, address_bits=12),
    "one_folded": Config(FloatFormat(2, 1), packets=1, address_bits=8, cache_words=16, folded=True),
    "twelve_folded": Config(FloatFormat(3, 3), packets=12, address_bits=12, folded=True),
}
TRIANGLES = 60
ROUNDS = 8 if simulator() == "verilator" else 2  # packets of each number


class Bench:
    """A tester at work, and the model of what it should say."""

    def __init__(self, dut):
        self.dut, self.name = dut, os.environ["CONFIG"]
        self.config = CONFIGS[self.name]
        self.tester = unbuilt(tester.Tester(self.config))
        self.rng = np.random.default_rng(cocotb.RANDOM_SEED)
        self.fmt = self.config.fmt
        self.triangles, self.vertices = self.rng.integers(0, 1 << self.config.address_bits, 2)
        self.tests = self.ray_tests = 0
        self.reads: list[int] = []  # cycles
        self.words: list[int] = []
        self.answers: list[int] = []
        self._scene()

    def _scene(self):
        """Triangles, many of them twice, and the memory with them."""
        config, rng = self.config, self.rng
        _, _, points = grid(self.fmt, rng, TRIANGLES)
        points = points.reshape(-1, 3)[:100]
        self.indices = rng.integers(0, len(points), (TRIANGLES, 3))
        again = rng.random(TRIANGLES) < 0.5
        self.indices[again] = self.indices[rng.integers(0, TRIANGLES, again.sum())]
        self.points = points
        self.memory = {}
        for base, layout, rows in (
            (self.triangles, records.TRIANGLE, self.indices),
            (self.vertices, records.vertex(self.fmt), points),
        ):
            columns = dict.fromkeys(dict(layout), np.zeros(len(rows), np.int64))
            columns |= dict(zip(dict(layout), rows.T, strict=False))
            for k, bits in enumerate(pack(layout, self.fmt, columns)):
                junk = random.getrandbits(records.word_bits(self.fmt)) >> layout.size
                address = (int(base) + k) % (1 << config.address_bits)
                self.memory[address, layout is records.TRIANGLE] = bits | junk << layout.size

    def layout(self, port: str):
        return getattr(self.tester, port).payload.shape()

    def payload(self, port: str, **fields) -> int:
        (bits,) = pack(self.layout(port), self.fmt, {k: [v] for k, v in fields.items()})
        return bits

    def fields(self, port: str, bits: int) -> dict[str, int]:
        places = leaves(self.layout(port), self.fmt)
        return {name: bits >> at & (1 << width) - 1 for name, at, width in places}

    async def begin(self, *, busy: float, latency: int):
        outputs, inputs = ("o_tests", "o_hits"), ("i_rays", "i_tests", "i_done")
        await start(
            self.dut,
            **{f"{self.name}__{port}__valid": 0 for port in (*inputs, "i_words")},
            **{f"{self.name}__{port}__ready": 0 for port in (*outputs, "o_reads")},
            **{f"{self.name}__triangles": int(self.triangles)},
            **{f"{self.name}__vertices": int(self.vertices), f"{self.name}__clear": 0},
        )
        self.to = {port: Queue() for port in inputs}
        self.sent = dict.fromkeys(inputs, 0)
        self.set_up_rays = 0
        self.of = [{port: Queue() for port in outputs} for _ in range(self.config.packets)]
        self.busy, self.latency = busy, latency
        for port in inputs:
            cocotb.start_soon(self._send(port))
        for port in outputs:
            cocotb.start_soon(self._receive(port))
        cocotb.start_soon(self._serve())

    async def _send(self, port):
        while True:
            await put(self.dut, f"{self.name}__{port}", [await self.to[port].get()], self.busy)
            self.sent[port] += 1

    async def _receive(self, port):
        while True:
            (bits,) = await take(self.dut, f"{self.name}__{port}", 1, self.busy)
            if port == "o_tests":
                self.answers.append(now())
            packet = bits & (1 << self.layout(port)["packet"].width) - 1
            self.of[packet][port].put_nowait(bits)

    async def _serve(self):
        """The memory: answers as they were asked after `latency`, or busily in any order."""
        reads, words = (f"{self.name}__{port}" for port in ("o_reads", "i_words"))
        part_bits = self.layout("o_reads")["tag"].width
        due = []
        while True:
            willing = not self.busy or random.random() >= self.busy
            getattr(self.dut, f"{reads}__ready").value = willing
            if self.busy:
                random.shuffle(due)
            answer = bool(due) and due[0][0] <= now() and random.random() >= self.busy
            getattr(self.dut, f"{words}__valid").value = answer
            getattr(self.dut, f"{words}__payload").value = (
                due.pop(0)[1] if answer else random.getrandbits(100)
            )
            await RisingEdge(self.dut.clk)
            if answer:
                self.words.append(now())
            if willing and getattr(self.dut, f"{reads}__valid").value:
                bits = getattr(self.dut, f"{reads}__payload").value.to_unsigned()
                tag, address = bits & (1 << part_bits) - 1, bits >> part_bits
                word = self.memory[address, tag >> part_bits - 2 == 3]
                due.append((now() + self.latency - 1, tag | word << part_bits))
                self.reads.append(now())

    async def set_up(self, packet: int) -> "Packet":
        """Send the rays of a packet."""
        rays = Packet(self)
        for number in range(RAYS):
            row = rays.rows[number]
            self.to["i_rays"].put_nowait(
                self.payload(
                    "i_rays",
                    packet=packet,
                    number=number,
                    t_max=rays.hits[number][0],
                    **{"ray.axis": row[AXIS_Z], "ray.t_min": rays.t_min[number]},
                    **{f"ray.origin.{a}": row[ORIGIN + k] for k, a in enumerate("xyz")},
                    **{f"ray.shear.{a}": row[SHEAR_X + k] for k, a in enumerate("xyz")},
                )
            )
        # Setup gives the last ray before the packet starts.
        self.set_up_rays += RAYS
        last = self.set_up_rays
        while self.sent["i_rays"] < last:
            await RisingEdge(self.dut.clk)
        return rays

    def test(self, packet: int, rays: "Packet", triangle: int, mask: int) -> int:
        """Send a test, and say which answer is to come."""
        self.to["i_tests"].put_nowait(
            self.payload("i_tests", packet=packet, triangle=triangle, mask=mask)
        )
        self.tests += 1
        self.ray_tests += mask.bit_count()
        rays.meet(triangle, mask)
        t = {f"t.{k}": rays.hits[k][0] for k in range(RAYS)}
        return self.payload("o_tests", packet=packet, **t)

    async def finish(self, packet: int, rays: "Packet"):
        self.to["i_done"].put_nowait(packet)
        for number in range(RAYS):
            got = self.fields("o_hits", await self.of[packet]["o_hits"].get())
            names = ("hit.t", "hit.u", "hit.v", "hit.triangle")
            want = dict(zip(names, map(int, rays.hits[number]), strict=True))
            assert got == {"packet": packet, "number": number, **want}

    def check_counters(self):
        counters = getattr(self.dut, f"{self.name}__counters").value.to_unsigned()
        assert counters == self.tests | self.ray_tests << 32


class Packet:
    """Four rays of the model, and their hits so far."""

    def __init__(self, bench: Bench):
        fmt, rng = bench.fmt, bench.rng
        self.bench = bench
        origins, directions, _ = grid(fmt, rng, RAYS)
        self.rows = setup(fmt, origins, directions)
        self.t_min = encode(fmt, rng.choice([0.0, -0.0, 0.25, 1.0, -np.inf, np.inf], RAYS))
        t_max = encode(fmt, rng.choice([np.inf, np.inf, 1.0, 2.0, -np.inf], RAYS))
        self.hits = [(int(t), 0, 0, NO_TRIANGLE) for t in t_max]

    def meet(self, triangle: int, mask: int):
        fmt, corners = self.bench.fmt, self.bench.points[self.bench.indices[triangle]]
        for k in range(RAYS):
            if not mask >> k & 1:
                continue
            hit, *where = intersect_bits(
                fmt.exp_bits,
                fmt.man_bits,
                self.rows[k],
                corners,
                np.empty((3, 3), np.int64),
                no_overflows(),
            )
            key, best = order_key(fmt, where[0]), order_key(fmt, self.hits[k][0])
            if (
                hit
                and order_key(fmt, self.t_min[k]) <= key
                and (key, triangle)
                < (
                    best,
                    self.hits[k][3],
                )
            ):
                self.hits[k] = (*where, triangle)


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("busy", "latency"), [(0.0, 1), (0.5, 1), (0.1, 60)]))
async def equals_model(dut, busy, latency):
    bench = Bench(dut)
    await bench.begin(busy=busy, latency=latency)
    hit = ties = 0

    async def live(packet: int):
        nonlocal hit, ties
        for _ in range(ROUNDS):
            rays = await bench.set_up(packet)
            first = {}
            for _ in range(random.randrange(30)):
                triangle, mask = random.randrange(TRIANGLES), random.randrange(1, 1 << RAYS)
                want = bench.test(packet, rays, triangle, mask)
                got = await bench.of[packet]["o_tests"].get()
                assert got == want, f"packet {packet}: {bench.fields('o_tests', got)}"
                for k, (t, _, _, best) in enumerate(rays.hits):
                    ties += first.get(k, (t, best))[0] == t and first.get(k, (t, best))[1] != best
                    first[k] = (t, best)
            await bench.finish(packet, rays)
            hit += sum(h[3] != NO_TRIANGLE for h in rays.hits)

    tasks = [cocotb.start_soon(live(packet)) for packet in range(bench.config.packets)]
    for task in tasks:
        await task
    bench.check_counters()
    if bench.config.packets > 1:
        assert hit > 10 * ROUNDS and ties > ROUNDS // 3, f"{hit} hits, {ties} ties"
    getattr(dut, f"{bench.name}__clear").value = 1
    for _ in range(3):
        await RisingEdge(dut.clk)
    assert getattr(dut, f"{bench.name}__counters").value.to_unsigned() == 0


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(mask=[1, 8, 7, 15])
async def rate_and_latency(dut, mask):
    bench = Bench(dut)
    await bench.begin(busy=0.0, latency=10)
    packets = range(bench.config.packets)
    rays = [await bench.set_up(packet) for packet in packets]
    for packet in packets:
        bench.test(packet, rays[packet], packet, mask)
    while len(bench.answers) < len(packets):
        await RisingEdge(dut.clk)
    if len(packets) == 1:
        assert bench.reads[1] - bench.words[0] == 2
        waited = bench.answers[0] - bench.words[-1]
        turns = bench.tester.turns
        assert waited - bench.tester.latency - turns * mask.bit_count() in range(turns)
    else:
        assert bench.reads == list(range(bench.reads[0], bench.reads[0] + 48)), "one a cycle"
        assert bench.words[-1] - bench.words[0] == 47
        gap = max(3, bench.tester.turns * mask.bit_count())  # records came before
        *gaps, to_last = np.diff(bench.answers).tolist()
        assert gaps == [gap] * 10
        assert gap - to_last in ((0, 1) if bench.config.folded else (0,)), "nothing follows it"


@pytest.mark.parametrize("name", CONFIGS)
def test_contract(name, tmp_path, seed):
    run_cocotb(one_of(tester.Tester, CONFIGS, name), __name__, tmp_path, seed=seed, CONFIG=name)
