"""hdl.rays.traversal, as Verilog, visit for visit against sim.model.rays.traversal."""

import os
import random
from dataclasses import replace

import cocotb
import numpy as np
import pytest

from hdl.config import FULL
from hdl.rays.queue import Queue
from hdl.rays.stack import Stack
from hdl.rays.step import Step
from hdl.rays.traversal import Traversal
from sim.cosim.verilate import simulator
from sim.model.rays.traversal import NO_TRIANGLE, trace
from tests.harness import one_of, run_cocotb
from tests.hdl.rays.scenes import RAYS, walk
from tests.hdl.rays.traversal_bench import CONFIGS, Bench, scene

QUICK = simulator() == "icarus"
PACKETS = 6 if QUICK else 30
NAMES = [name for name in CONFIGS if not (QUICK and name == "full")]
ON_FULL = os.environ.get("CONFIG") == "full"


def counts(walks) -> dict[str, int]:
    """Counters of some walks."""
    children = [visit.child for way in walks for visit in way.visits]
    return {
        "steps": sum(child >= 0 for child in children),
        "tests": sum(child < 0 for child in children),
        "pushes": sum(way.pushes for way in walks),
        "pops": sum(way.pops for way in walks),
    }


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(
    kind=["sphere", "soup", "one", "random", "balanced", "chain"],
    traffic=[((1, 1), 0.0), ((1, 30), 0.4)],
)
async def visits_equal_model(dut, kind, traffic):
    name = os.environ["CONFIG"]
    rng = np.random.default_rng(random.getrandbits(32))
    delays, busy = traffic
    bench = Bench(dut, name, scene(kind, CONFIGS[name], rng, PACKETS), delays=delays, busy=busy)
    found = await bench.run()
    assert found == counts(bench.walks)
    assert found["steps"] > 0


@cocotb.test(timeout_time=10, timeout_unit="ms", skip=not ON_FULL)
async def takes_its_latency(dut):
    """A packet alone: each request comes as long after the answer before it as is said."""
    rng = np.random.default_rng(random.getrandbits(32))
    alone = scene("sphere", FULL, rng, 200)
    longest = max(range(alone.packets), key=lambda k: len(walk(alone, k).visits))
    rays = slice(RAYS * longest, RAYS * (longest + 1))
    alone = replace(alone, rows=alone.rows[rays], limits=alone.limits[rays])
    bench = Bench(dut, "full", alone)
    await bench.run()
    visits = bench.walks[0].visits
    first, *rest = bench.requests
    assert first - bench.begun[0] == Stack.latency + Queue.latency - 2, "a start waits 2 cycles"
    for k, (request, answer) in enumerate(zip(rest, bench.answers, strict=False)):
        from_node, pops = visits[k].child >= 0, visits[k + 1].pops
        cycles = Queue.latency + pops * Stack.latency
        cycles += from_node * (Step(FULL).latency + (pops > 0))
        assert request - answer == cycles, f"visit {k + 1} of {visits[k : k + 2]}"
    assert {v.pops for v in visits} >= {0, 1, 2}


@cocotb.test(timeout_time=10, timeout_unit="ms", skip=not ON_FULL)
async def one_step_a_cycle(dut):
    """With all packets under way and a memory of 3 cycles."""
    rng = np.random.default_rng(random.getrandbits(32))
    bench = Bench(dut, "full", scene("sphere", FULL, rng, 200), delays=(3, 3))
    found = await bench.run()
    total = bench.steps[-1] - bench.steps[0]
    first, last = bench.begun[FULL.packets - 1], bench.begun[-1]
    steps = sum(first <= cycle < last for cycle in bench.steps)
    cocotb.log.info(f"{found} in {total} cycles; {steps} in {last - first} with all packets")
    assert last - first <= steps * 1.02
    assert total <= found["steps"] * 1.1 + 400, "with those in which packets are missing"


@pytest.mark.parametrize("name", NAMES)
def test_equals_model(name, tmp_path, seed):
    run_cocotb(one_of(Traversal, CONFIGS, name), __name__, tmp_path, seed=seed, CONFIG=name)


@pytest.mark.parametrize("kind", ["sphere", "soup", "one"])
def test_walks_are_those_of_the_model(kind, rng):
    tried = scene(kind, FULL, rng, 40)
    hits = trace(
        tried.fmt, tried.order, tried.bounds, tried.corners, tried.origins, tried.directions,
        *tried.limits.T,
    )  # fmt: skip
    walks = [walk(tried, packet) for packet in range(tried.packets)]
    found = counts(walks) | {"deepest": max(way.deepest for way in walks)}
    assert found == {name: hits.counters[name] for name in found}
    assert [t for way in walks for t in way.best] == hits.t.tolist()
    triangles = [NO_TRIANGLE if hit is None else hit for way in walks for hit in way.hits]
    assert triangles == hits.triangle.tolist()
