"""A core, and beside it the memory that it should have, word for word; rays of all kinds for it."""

import numpy as np

from hdl.core import counters
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
from sim.cosim.machine import Machine
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays, camera
from sim.model.rays.traversal import NO_TRIANGLE
from sim.model.refit import refit
from sim.report.passes import COUNTED

WORST = 1500
"""Cycles a ray, at the least latency."""


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
