"""hdl.core with instances, as Verilog: hits, counters and flags of forests as the model's."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import FULL, Config
from hdl.core import Core
from hdl.fp.format import FloatFormat
from hdl.rays.packet import NO_TRIANGLE
from sim.compiler.rays import hit_words, hits_of, ray_words
from sim.cosim.machine import Machine, Timing
from sim.cosim.verilate import simulator
from sim.model.rays.traversal import trace
from sim.report.passes import COUNTED
from tests.hdl.rays.forests import ANY, WELL, Forest, forest, rays_at

CONFIGS = {
    "tiny": Config(
        FloatFormat(5, 7), latency=4, address_bits=16, packets=3, stack_depth=16, cache_words=16,
        instances=True, pointer_bits=13,
    ),
    "banks": Config(
        FloatFormat(5, 7), latency=2, address_bits=16, packets=4, stack_depth=16, cache_words=0,
        instances=True, update=False, camera=False,
    ),
    "full": replace(FULL, instances=True),
}  # fmt: skip
TIMINGS = (Timing(1), Timing(32), Timing(20, 0.3, 5))
QUICK = simulator() == "icarus"
FORESTS = 1 if QUICK else 6
PACKETS = 4 if QUICK else 60
WORDS = 2048
WORST = 4000  # cycles a ray, at the least latency


def cast(machine: Machine, scene: Forest, rays) -> tuple[dict, np.ndarray]:
    """Counters of a job, and the words of its hits."""
    config, count = machine.config, len(rays[0])
    words, place = scene.words(config)
    machine.write(0, words)
    machine.write(WORDS, ray_words(config, *rays))
    job = {
        "casts": 1,
        "cast": {
            "scene": place,
            **({"camera": 0} if config.camera else {}),
            "rays": {"address": WORDS, "packets": count // 4},
            "hits": WORDS + 2 * count,
        },
    }
    if config.update:
        job["program"] = {"address": 0, "length": 0}
    counters = machine.run(job, WORST * (4 + machine.timing.latency) * count)
    return counters, machine.read(WORDS + 2 * count, count)


@pytest.mark.parametrize("name", CONFIGS)
def test_hits_are_those_of_the_model(name, rng):
    config = CONFIGS[name]
    fmt = config.fmt
    inside = entries = 0
    infinite = set()
    with Machine(config, WORDS + 12 * PACKETS, Timing(), unit=Core) as machine:
        for k in range(FORESTS):
            machine.reset(TIMINGS[k % len(TIMINGS)])
            scene = forest(fmt, rng, matrices=ANY if k % 2 else WELL)
            rays = rays_at(fmt, scene, rng, PACKETS)
            want = trace(
                fmt, scene.order, scene.bounds, scene.corners, *rays,
                margin=scene.margin, instances=scene.instances,
            )  # fmt: skip
            counters, words = cast(machine, scene, rays)
            columns = {x: getattr(want, x) for x in ("t", "u", "v", "triangle", "instance")}
            wrong = np.flatnonzero((words != hit_words(config, columns)).any(axis=1))
            found = hits_of(config, words)
            assert not len(wrong), (
                f"forest {k}: {len(wrong)} hits differ, first {wrong[0]}: "
                f"{ {x: (int(found[x][wrong[0]]), int(columns[x][wrong[0]])) for x in columns} }"
            )
            counted = {key: counters["cast"][key] for key in ("packets", *COUNTED)}
            counted["entries"] = counters["instances"]["entries"]
            assert counted == {key: want.counters[key] for key in counted}, f"forest {k}"
            overflows = {key: counters["overflows"][key] for key in want.overflows}
            assert overflows == want.overflows, f"forest {k}"
            if config.cache_words:
                assert sum(counters["geometry"].values()) == 4 * counted["tests"]
            inside += int((want.instance != NO_TRIANGLE).sum())
            entries += counted["entries"]
            infinite.add(want.overflows["transform"])
    assert inside > 10 * FORESTS and entries > FORESTS * PACKETS
    assert QUICK or infinite == {False, True}
