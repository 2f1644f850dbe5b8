"""hdl.rays.caster, as Verilog: rays in memory to hits in memory, as the model says."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from hdl.rays.caster import RayCaster, cast_job
from sim.compiler.rays import hit_words, hits_of, ray_words
from sim.cosim.machine import Machine, Timing
from sim.cosim.verilate import simulator
from sim.model.fp.format import decode, encode
from sim.model.rays.traversal import trace
from sim.model.refit import refit
from sim.prepare import prepare
from sim.scene.load import load_scene

CONFIGS = {
    "tiny": Config(
        FloatFormat(5, 7), latency=4, address_bits=16, packets=3, stack_depth=16, cache_words=16
    ),
    "full": replace(FULL, address_bits=20, cache_words=256),
}
WORST = 5000  # cycles a ray


def rays(rng, fmt, count):
    """Random rays from outside and inside, some parallel to axes, and some that are not there."""
    origins = rng.uniform(-2, 2, (count, 3)) * rng.choice([0.2, 1], (count, 1))
    directions = rng.normal(size=(count, 3)) - 1.5 * origins
    directions[rng.random((count, 3)) < 0.1] = 0.0
    directions[rng.random((count, 3)) < 0.1] = -0.0
    t_min, t_max = np.zeros(count), np.full(count, np.inf)
    some = rng.random(count) < 0.2
    t_min[some], t_max[some] = 0.5, 1.5
    gone = rng.random(count) < 0.2
    gone[:4] = True  # a whole packet
    t_min[gone], t_max[gone] = np.inf, -np.inf
    return tuple(encode(fmt, x) for x in (origins, directions, t_min, t_max))


@pytest.mark.parametrize("name", CONFIGS)
def test_hits_are_those_of_the_model(name, rng):
    config = CONFIGS[name]
    count = 40 if simulator() == "icarus" else 400
    prepared = prepare(load_scene("walker:500"), config)
    image, fmt = prepared.image, config.fmt
    bits = prepared.coordinates(3)
    bounds, corners = (
        refit(fmt, image.order, bits[prepared.leaf_vertices]),
        bits[prepared.leaf_vertices],
    )
    words = image.constant_words()
    words[image.vertices_at : image.triangles_at] = image.vertex_words(bits)
    words[image.nodes_at :] = image.node_words(bounds)
    rays_at, hits_at = image.size, image.size + 2 * count

    with Machine(config, hits_at + count, Timing(), unit=RayCaster) as machine:
        for timing in (Timing(1), Timing(32), Timing(20, 0.3, 5)):
            some = rays(rng, fmt, count)
            before = np.concatenate([
                words,
                ray_words(config, *some),
                rng.integers(0, 2**32, (count, words.shape[1]), dtype=np.uint32),
            ])
            machine.reset(timing)
            machine.write(0, before)
            for packets in (0, count // 8, count // 4):
                job = cast_job(config).const({
                    "rays": {"address": rays_at, "packets": packets},
                    "root": image.nodes - 1,
                    "nodes": image.nodes_at,
                    "triangles": image.triangles_at,
                    "vertices": image.vertices_at,
                    "hits": hits_at,
                })
                counters = machine.run(job.as_bits(), 20_000 + WORST * count)
                expected = trace(
                    fmt, image.order, bounds, corners, *(x[: 4 * packets] for x in some)
                )
                after = before.copy()
                columns = {field: getattr(expected, field) for field in ("t", "u", "v", "triangle")}
                after[hits_at : hits_at + 4 * packets] = hit_words(config, columns)
                found = machine.read(0, len(after))
                wrong = np.flatnonzero((found != after).any(axis=1))
                assert not len(wrong), (
                    f"{len(wrong)} words differ, first that of ray {wrong[0] - hits_at}: "
                    f"{hits_of(config, found[wrong[:1]])}, not {hits_of(config, after[wrong[:1]])}"
                )
                before = after
                for key in ("packets", "steps", "tests", "ray_tests", "pushes", "pops"):
                    assert counters[key] == expected.counters[key], key
                assert counters["node_hits"] + counters["node_misses"] == counters["steps"]
                assert (
                    counters["geometry_hits"] + counters["geometry_misses"] == 4 * counters["tests"]
                )
            assert (decode(fmt, expected.t)[expected.triangle < 2**28 - 1] >= 0).all()
            assert 0.02 < (expected.triangle < 2**28 - 1).mean() < 0.9
