"""hdl.core, as Verilog: an update and rays on one memory, word for word as the model."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import FULL, Config
from hdl.core import Core, counters
from hdl.fp.format import FloatFormat
from hdl.isa import LAYOUTS, Opcode
from sim.compiler.rays import (
    View,
    camera_fields,
    hit_words,
    hits_of,
    memory_fields,
    ray_words,
    scene_fields,
)
from sim.cosim.machine import Machine, Timing
from sim.cosim.verilate import simulator
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays, camera
from sim.model.rays.traversal import NO_TRIANGLE
from sim.model.refit import refit
from sim.prepare import prepare
from sim.report.passes import COUNTED
from sim.scene.load import load_scene
from tests.sim.compiler.forests import random_forest

TINY = Config(
    FloatFormat(5, 7), latency=4, address_bits=16, packets=3, stack_depth=16, cache_words=16
)
CONFIGS = {
    "tiny": TINY,
    "banks": replace(TINY, latency=2, packets=4, cache_words=0),
    "folded": replace(TINY, packets=5, folded=True),
    "full": FULL,
}
TIMINGS = (Timing(1), Timing(32), Timing(20, 0.3, 5))
QUICK = simulator() == "icarus"  # a thousand cycles a second
NAMES = [name for name in CONFIGS if not (QUICK and name == "banks")]
WITH_INSTANCES = [
    pytest.param(name, marks=pytest.mark.slow if name in ("full", "banks") else ())
    for name in NAMES
]
SCENE = "waves:50" if QUICK else "walker:500"
WORST = 1500  # cycles a ray, at the least latency


def random_rays(rng, fmt, count):
    """Rays from outside and inside, some parallel to axes, and some that are not there."""
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


def random_view(rng, fmt, width, height) -> View:
    """A camera at some distance that looks about to the middle."""
    origin = rng.normal(size=3)
    origin *= 3 / np.linalg.norm(origin)
    right, down = np.linalg.qr(np.stack([origin, *rng.normal(size=(2, 3))], axis=1))[0].T[1:]
    right, down = right / width, down / width
    corner = -origin / 3 - right * (width - 1) / 2 - down * (height - 1) / 2
    vectors = (encode(fmt, x) for x in (origin, corner, right, down))
    limits = int(encode(fmt, 0.0)), int(encode(fmt, np.inf))
    return View(*vectors, width, height, *limits)


class Checked:
    """A core, and beside it the memory that it should have: a walker, room for rays and hits."""

    def __init__(self, machine: Machine, prepared, rays: int, rng):
        self.machine, self.prepared, self.rng = machine, prepared, rng
        self.config, self.image = prepared.config, prepared.image
        self.rays_at = self.image.size
        self.hits_at = self.image.size + 2 * rays
        self.memory = rng.integers(
            0, 2**32, (self.hits_at + rays, self.image.limbs), dtype=np.uint32
        )
        self.memory[: self.image.size] = self.image.constant_words()
        machine.write(0, self.memory)
        places = counters(self.config)["overflows"].shape
        self.overflows = dict.fromkeys(places.members, False)
        self.bounds: np.ndarray | None = None
        loads = self.image.instructions[self.image.instructions & 3 == Opcode.LOAD.value]
        self.loaded = self.image.vertices[loads >> LAYOUTS[Opcode.LOAD]["vertex"].offset]

    def pose(self, frame: int, infinite: int = 0):
        """Vertices of a frame, some of them infinite; the bounds in memory stay.

        Those that nothing updates are written too.
        """
        image = self.image
        self.bits = self.prepared.coordinates(frame)
        of = self.rng.integers(len(self.bits), size=infinite)
        self.bits[of, self.rng.integers(3, size=infinite)] = encode(self.config.fmt, np.inf)
        self.rows = self.prepared.rows(frame)
        self.memory[image.vertices_at : image.rows_at] = image.vertex_words(self.bits)
        self.memory[image.rows_at : image.triangles_at] = image.row_words(self.rows)
        moving = self.memory[image.vertices_at : image.triangles_at]
        self.machine.write(image.vertices_at, moving)
        # No program updates the trees of objects.
        bounds = refit(self.config.fmt, image.order, self._corners())
        first = image.world if self.config.update else 0
        still = slice(image.nodes_at + first, image.still_at)
        self.memory[still] = image.node_words(bounds)[first:]
        self.machine.write(still.start, self.memory[still])
        older = bounds if self.bounds is None else self.bounds
        self.bounds = np.concatenate([older[:first], bounds[first:]])

    def _corners(self) -> np.ndarray:
        return self.bits[self.prepared.leaf_vertices]

    def run(
        self, *, updates: bool, casts: dict | None, rays=(), beyond: bool = False
    ) -> tuple[dict, np.ndarray]:
        """Run a job and compare all of memory; its counters, and the triangle of each ray.

        `beyond` says that numbers became infinite in the camera.
        """
        image, config, memory = self.image, self.config, self.memory
        corners = self._corners()
        if updates:
            loaded = decode(config.fmt, self.bits[self.loaded])
            self.overflows["update"] = bool(np.isinf(loaded).any())
            self.bounds = refit(config.fmt, image.order, corners)
            memory[image.nodes_at : image.still_at] = image.node_words(self.bounds)
        program = {"program": {"address": 0, "length": len(image.instructions)}}
        counters = self.machine.run(
            {
                **(program if updates else {}),
                "casts": casts is not None,
                "cast": {"scene": scene_fields(image), "hits": self.hits_at, **(casts or {})},
            },
            200_000 + WORST * (4 + self.machine.timing.latency) * (len(rays[0]) if rays else 0),
        )
        triangles = np.empty(0)
        if rays:
            expected = self.prepared.trace(
                self.bits, self.rows, self.bounds, Rays(*rays, np.empty(0))
            )
            triangles = expected.triangle
            infinite = {"camera": beyond, **expected.overflows}
            self.overflows |= {k: infinite[k] for k in infinite if k in self.overflows}
            columns = expected.fields(config)
            self.within = expected.instance != NO_TRIANGLE
            memory[self.hits_at : self.hits_at + len(triangles)] = hit_words(config, columns)
            found = {key: counters["cast"][key] for key in ("packets", *COUNTED)}
            assert found == {key: expected.counters[key] for key in found}
            if config.cache_words:
                reads = {kind: sum(counters[kind].values()) for kind in ("nodes", "geometry")}
                assert reads == {"nodes": found["steps"], "geometry": 4 * found["tests"]}
        assert counters["overflows"] == self.overflows
        found = self.machine.read(0, len(memory))
        wrong = np.flatnonzero((found != memory).any(axis=1))
        assert not len(wrong), (
            f"{len(wrong)} words differ, first {wrong[0]} (hits from {self.hits_at}): "
            f"{hits_of(config, found[wrong[:1]])}, not {hits_of(config, memory[wrong[:1]])}"
        )
        return counters, triangles

    def cast(self, rays, *, updates: bool = False) -> np.ndarray:
        """Cast rays from memory; the triangle of each."""
        words = ray_words(self.config, *rays)
        self.memory[self.rays_at : self.rays_at + len(words)] = words
        self.machine.write(self.rays_at, words)
        casts = memory_fields(self.config, self.rays_at, len(rays[0]) // 4)
        return self.run(updates=updates, casts=casts, rays=rays)[1]

    def look(self, view: View, *, updates: bool = False) -> np.ndarray:
        """Cast the rays of a camera; the triangle of each."""
        vectors = view.origin, view.corner, view.right, view.down
        limits = view.t_min, view.t_max
        rays = camera(self.config.fmt, *vectors, view.width, view.height, *limits)
        casts = camera_fields(self.config, view)
        columns = (np.ascontiguousarray(rays.origins), rays.directions, rays.t_min, rays.t_max)
        return self.run(updates=updates, casts=casts, rays=columns, beyond=rays.overflow)[1]


@pytest.mark.parametrize("name", NAMES)
def test_memory_is_that_of_the_model(name, rng):
    config = CONFIGS[name]
    count = 24 if QUICK else 200
    prepared = prepare(load_scene(SCENE), config)
    shares = []
    with Machine(config, prepared.image.size + 3 * count, Timing(), unit=Core) as machine:
        checked = Checked(machine, prepared, count, rng)
        for frame, timing in enumerate(TIMINGS[-1:] if QUICK else TIMINGS):
            machine.reset(timing)
            checked.pose(frame)
            checked.cast(random_rays(rng, config.fmt, count // 2), updates=True)
            triangles = checked.cast(random_rays(rng, config.fmt, count))
            shares.append((triangles != NO_TRIANGLE).mean())
            for size in ((1, 1), (3, 6), (count // 4 - 1, 3)):
                checked.look(random_view(rng, config.fmt, *size), updates=size[0] == 3)
    assert 0.02 < np.mean(shares) < 0.9


@pytest.mark.parametrize("name", WITH_INSTANCES)
def test_instances(name, rng):
    """Rays through worlds of triangles and instances, that move from frame to frame."""
    config = replace(CONFIGS[name], instances=True)
    count = 24 if QUICK else 200
    prepared = random_forest(rng, config)
    within = []
    with Machine(config, prepared.image.size + 3 * count, Timing(), unit=Core) as machine:
        checked = Checked(machine, prepared, count, rng)
        for frame, timing in enumerate(TIMINGS[-1:] if QUICK else TIMINGS):
            machine.reset(timing)
            checked.pose(frame)
            checked.cast(random_rays(rng, config.fmt, count), updates=True)
            within.append(checked.within)
            checked.look(random_view(rng, config.fmt, count // 4 - 1, 3))
            within.append(checked.within)
    assert QUICK or 0.05 < np.concatenate(within).mean() < 0.9


@pytest.mark.parametrize("instances", [False, True])
def test_overflows_are_flagged(instances, rng):
    """Jobs of a packet or two, with numbers of all magnitudes: each flag as the model says."""
    config = CONFIGS["tiny"]
    prepared = prepare(load_scene(SCENE), config)
    if instances:
        config = replace(CONFIGS["folded"], instances=True)
        prepared = random_forest(rng, config)
    seen = []
    with Machine(config, prepared.image.size + 48, Timing(1), unit=Core) as machine:
        checked = Checked(machine, prepared, 16, rng)
        for job in range(3 if QUICK else 150):
            checked.pose(job % 3, infinite=job % 4 // 2)
            origins, directions, *limits = random_rays(rng, config.fmt, 8)
            factors = 2.0 ** rng.integers(-14, 17, (2, 8, 1))
            origins, directions = (
                encode(config.fmt, decode(config.fmt, x) * factor)
                for x, factor in zip((origins, directions), factors, strict=True)
            )
            checked.cast((origins, directions, *limits), updates=job % 2 == 0)
            seen.append(list(checked.overflows.values()))
            view = random_view(rng, config.fmt, 8, 2)
            far = int(rng.integers(0, 19))
            right = encode(config.fmt, decode(config.fmt, view.right) * 2.0**far)
            checked.look(replace(view, right=right))
            seen.append(list(checked.overflows.values()))
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
    with Machine(config, prepared.image.size + 3 * count, Timing(), unit=Core) as machine:
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
