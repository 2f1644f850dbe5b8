"""hdl.core, as Verilog: an update and rays on one memory, word for word as the model."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.core import Core
from sim.compiler.rays import memory_fields, ray_words
from sim.cosim.machine import Machine, Timing
from sim.cosim.verilate import simulator
from sim.model.fp.format import decode, encode
from sim.model.rays.traversal import NO_TRIANGLE
from sim.prepare import prepare
from sim.scene.load import load_scene
from tests.hdl.checked import Checked, random_rays, random_view
from tests.hdl.machines import CONFIGS
from tests.sim.compiler.forests import random_forest

TIMINGS = (Timing(1), Timing(32), Timing(20, 0.3, 5))
QUICK = simulator() == "icarus"  # a thousand cycles a second
NAMES = [name for name in CONFIGS if not (QUICK and name == "banks")]
WITH_INSTANCES = [
    pytest.param(name, marks=pytest.mark.slow if name in ("full", "banks") else ())
    for name in NAMES
]
SCENE = "waves:50" if QUICK else "walker:500"
COUNT = 8 if QUICK else 200
"""Rays at once."""
JOBS = 1 if QUICK else 100
FOREST = (12, 2) if QUICK else (40, 5)
"""Triangles, and instances."""


@pytest.mark.parametrize("name", NAMES)
def test_memory_is_that_of_the_model(name, rng):
    config = CONFIGS[name]
    prepared = prepare(load_scene(SCENE), config)
    shares = []
    with Machine(config, prepared.image.size + 3 * COUNT, Timing(), unit=Core) as machine:
        checked = Checked(machine, prepared, COUNT, rng)
        for frame, timing in enumerate(TIMINGS[-1:] if QUICK else TIMINGS):
            machine.reset(timing)
            checked.pose(frame)
            checked.cast(random_rays(rng, config.fmt, COUNT // 2), updates=True)
            triangles = checked.cast(random_rays(rng, config.fmt, COUNT))
            shares.append((triangles != NO_TRIANGLE).mean())
            for size in ((1, 1), (3, 2 if QUICK else 6), (COUNT // 4 - 1, 3)):
                checked.look(random_view(rng, config.fmt, *size), updates=size[0] == 3)
    assert 0.02 < np.mean(shares) < 0.9


@pytest.mark.parametrize("name", WITH_INSTANCES)
def test_instances(name, rng):
    """Rays through worlds of triangles and instances, that move from frame to frame."""
    config = replace(CONFIGS[name], instances=True)
    prepared = random_forest(rng, config, *FOREST)
    within = []
    with Machine(config, prepared.image.size + 3 * COUNT, Timing(), unit=Core) as machine:
        checked = Checked(machine, prepared, COUNT, rng)
        for frame, timing in enumerate(TIMINGS[-1:] if QUICK else TIMINGS):
            machine.reset(timing)
            checked.pose(frame)
            checked.cast(random_rays(rng, config.fmt, COUNT), updates=True)
            within.append(checked.within)
            checked.look(random_view(rng, config.fmt, COUNT // 4 - 1, 3))
            within.append(checked.within)
    assert QUICK or 0.05 < np.concatenate(within).mean() < 0.9


@pytest.mark.parametrize("instances", [False, True])
def test_overflows_are_flagged(instances, rng):
    """Jobs of a packet or two, with numbers of all magnitudes: each flag as the model says."""
    config = CONFIGS["tiny"]
    prepared = prepare(load_scene(SCENE), config)
    if instances:
        config = CONFIGS["folded"]
        prepared = random_forest(rng, config, *FOREST)
    seen = []
    infinity = int(encode(config.fmt, np.inf))
    places = ["update", "camera", "setup", "planes", "triangles", *["transform"] * instances]
    with Machine(config, prepared.image.size + 48, Timing(1), unit=Core) as machine:
        checked = Checked(machine, prepared, 16, rng)
        for job in range(JOBS):
            checked.pose(job % 3, infinite=job % 4 // 2)
            origins, directions, *limits = random_rays(rng, config.fmt, 8)
            factors = 2.0 ** rng.integers(-14, 17, (2, 8, 1))
            origins, directions = (
                encode(config.fmt, decode(config.fmt, x) * factor)
                for x, factor in zip((origins, directions), factors, strict=True)
            )
            origins[rng.random(origins.shape) < 0.01] = infinity - 1  # the largest number
            checked.cast((origins, directions, *limits), updates=job % 2 == 0)
            seen.append([checked.overflows[place] for place in places])
            view = random_view(rng, config.fmt, 8, 2)
            far = int(rng.integers(0, 19))
            right = encode(config.fmt, decode(config.fmt, view.right) * 2.0**far)
            checked.look(replace(view, right=right))
            seen.append([checked.overflows[place] for place in places])
    shares = np.mean(seen, axis=0)
    assert QUICK or (0.02 < shares).all() and (shares < 0.98).all(), shares


def test_a_job_of_nothing_ends(rng):
    config = CONFIGS["tiny"]
    prepared = prepare(load_scene(SCENE), config)
    with Machine(config, prepared.image.size + 12, Timing(), unit=Core) as machine:
        checked = Checked(machine, prepared, 4, rng)
        checked.pose(0)
        checked.run(updates=True, casts=None)
        none = tuple(x[:0] for x in random_rays(rng, config.fmt, 4))
        checked.cast(none)
        counters, _ = checked.run(updates=False, casts=None)
    assert counters["cast"]["packets"] == counters["cast"]["steps"] == 0
    assert counters["update"]["instructions"] == len(prepared.image.instructions), "of the last one"


def test_its_cycles_are_steps_and_waits(rng):
    """What is counted is the length of the run, but for the cycles in which a job changes hands."""
    config = CONFIGS["tiny"]
    prepared = prepare(load_scene(SCENE), config)
    count = 8 if QUICK else 40
    with Machine(config, prepared.image.size + 3 * COUNT, Timing(), unit=Core) as machine:
        checked = Checked(machine, prepared, count, rng)
        checked.pose(0)
        checked.run(updates=True, casts=None)
        cycles = []
        for latency in (1, 60):
            machine.reset(Timing(latency))
            rays = random_rays(np.random.default_rng(3), config.fmt, count)
            words = ray_words(config, *rays)
            checked.memory[checked.rays_at : checked.rays_at + len(words)] = words
            machine.write(checked.rays_at, words)
            casts = memory_fields(config, checked.rays_at, count // 4)
            counters, _ = checked.run(updates=False, casts=casts, rays=rays)
            waits = counters["cast"]["waits"]
            cycles.append(counters["cast"]["steps"] + sum(waits.values()))
            assert counters["cast"]["steps"] > 0
        assert waits["nodes"] + waits["tests"] + waits["rays"] > 0.9 * sum(waits.values())
        assert cycles[1] > 2 * cycles[0], "a slower memory shows in the waits"
