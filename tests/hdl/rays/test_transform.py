"""hdl.rays.transform, as Verilog, bit for bit against sim.model.rays.transform."""

import os

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hdl.config import Config
from hdl.fp.format import F24, FloatFormat
from hdl.rays.packet import RAYS
from hdl.rays.transform import Transform
from sim.cosim.verilate import simulator
from sim.model.fp.format import encode
from sim.model.rays.overflow import TRANSFORM, no_overflows
from sim.model.rays.transform import transform_bits
from tests.harness import one_of, run_cocotb, unbuilt
from tests.hdl.fp.operands import operands
from tests.payloads import difference, pack
from tests.streams import now, put, start, take

CONFIGS = {
    "one": Config(FloatFormat(2, 1), packets=1, instances=True),
    "tiny": Config(FloatFormat(3, 2), packets=3, instances=True),
    "f24": Config(F24, instances=True),
}
ENTRIES = 800 if simulator() == "verilator" else 30


class Cases:
    """Rays of all packets, and entries of packets in a random order with what comes of them."""

    def __init__(self, config: Config, rng, entries: int):
        fmt, packets = config.fmt, config.packets
        self.fmt, unit = fmt, unbuilt(Transform(config))
        self.layouts = {x: getattr(unit, x).payload.shape() for x in ("i_worlds", "i", "o")}
        count = max(RAYS * packets, entries)
        words = operands(fmt, rng, 6, -(-count // 3) + 1)
        rays = words[rng.permutation(len(words))[:count]][: RAYS * packets]
        limits = rng.integers(0, 1 << fmt.bits, (RAYS * packets, 2))
        halves = {"packet": [], "number": [], "second": [], "half.t": []}
        halves |= {f"half.point.{a}": [] for a in "xyz"}
        for place in rng.permutation(2 * RAYS * packets).tolist():
            ray, second = divmod(place, 2)
            point = dict(zip("xyz", rays[ray, 3 * second :], strict=False))
            values = {f"half.point.{a}": x for a, x in point.items()}
            values |= {"packet": ray // RAYS, "number": ray % RAYS}
            values |= {"second": second, "half.t": limits[ray, second]}
            for name, value in values.items():
                halves[name].append(value)
        self.worlds = pack(self.layouts["i_worlds"], fmt, halves)

        rows = operands(fmt, rng, 12, -(-entries // 3) + 1)
        self.rows = rows[rng.permutation(len(rows))[:entries]].reshape(-1, 3, 4)
        self.of = rng.integers(0, packets, entries)
        self.masks = rng.integers(1, 1 << RAYS, entries)
        columns = {"packet": self.of, "mask": self.masks}
        columns |= {"root": rng.integers(0, 1 << config.pointer_bits, entries)}
        for k in range(3):
            for column, name in enumerate(("x", "y", "z", "offset")):
                columns[f"rows.{k}.{name}"] = self.rows[:, k, column]
        self.entries = pack(self.layouts["i"], fmt, columns)
        self._expect(rays, limits)

    def _expect(self, rays, limits):
        fmt, rows = self.fmt, []
        self.overflows = []
        for entry, packet in enumerate(self.of.tolist()):
            overflows = no_overflows()
            for number in range(RAYS):
                ray, to = RAYS * packet + number, np.empty((2, 3), np.int64)
                form = fmt.exp_bits, fmt.man_bits
                transform_bits(
                    *form, self.rows[entry], rays[ray, :3], rays[ray, 3:], *to, overflows
                )
                there = self.masks[entry] >> number & 1
                never = encode(fmt, np.inf), encode(fmt, -np.inf)
                rows.append([packet, number, *to.ravel(), *(limits[ray] if there else never)])
            self.overflows.append(bool(overflows[TRANSFORM]))
        names = ["packet", "number"]
        names += [f"ray.{part}.{a}" for part in ("origin", "direction") for a in "xyz"]
        names += ["ray.t_min", "ray.t_max"]
        columns = dict(zip(names, np.array(rows).T, strict=True))
        self.expected = pack(self.layouts["o"], fmt, columns)


async def begin(dut, name: str, cases: Cases):
    ports = {f"{name}__{port}__valid": 0 for port in ("i_worlds", "i")}
    await start(dut, **ports, **{f"{name}__o__ready": 0})
    valid, payload = (getattr(dut, f"{name}__i_worlds__{x}") for x in ("valid", "payload"))
    valid.value = 1
    for word in cases.worlds:
        payload.value = word
        await RisingEdge(dut.clk)
    valid.value = 0


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("idle", "busy"), [(0.0, 0.0), (0.9, 0.0), (0.2, 0.7), (0.0, 0.95)]))
async def equals_model(dut, idle, busy):
    name = os.environ["CONFIG"]
    cases = Cases(CONFIGS[name], np.random.default_rng(cocotb.RANDOM_SEED), ENTRIES)
    await begin(dut, name, cases)
    first, cycles = now(), []
    cocotb.start_soon(put(dut, f"{name}__i", cases.entries, idle))
    found = await take(dut, f"{name}__o", len(cases.expected), busy, cycles)
    for k, (got, want) in enumerate(zip(found, cases.expected, strict=True)):
        assert got == want, f"ray {k}: {difference(cases.fmt, cases.layouts['o'], got, want)}"
    if not idle and not busy:
        latency = unbuilt(Transform(CONFIGS[name])).latency
        assert cycles[0] - first == 1 + latency
        assert set(np.diff(cycles[::RAYS])) == {25}
        assert set(np.diff(cycles[:RAYS])) == {6}


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def overflows_are_seen(dut):
    """A packet at a time, with its flag."""
    name = os.environ["CONFIG"]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    cases = Cases(CONFIGS[name], rng, ENTRIES // 8)
    await begin(dut, name, cases)
    overflow, seen = getattr(dut, f"{name}__overflow"), []
    getattr(dut, f"{name}__o__ready").value = 1
    for word in cases.entries:
        cocotb.start_soon(put(dut, f"{name}__i", [word]))
        flag = False
        for _ in range(60):
            await RisingEdge(dut.clk)
            flag |= bool(overflow.value)
        seen.append(flag)
    assert seen == cases.overflows
    assert 0 < sum(seen) < len(seen)


@pytest.mark.parametrize("name", CONFIGS)
def test_equals_model(name, tmp_path, seed):
    run_cocotb(one_of(Transform, CONFIGS, name), __name__, tmp_path, seed=seed, CONFIG=name)
