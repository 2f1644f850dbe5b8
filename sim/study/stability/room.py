"""A screw of 1e-3 in a room of 1e4, seen from nearby: what of it is left."""

import numpy as np

from hdl.fp.format import FloatFormat
from sim.oracle.trace import trace
from sim.study.stability.rows import Counts, row
from sim.study.stability.shapes import cube, unit
from sim.study.stability.tracers import Make, systems

ROOM, SCREW = 1e4, 1e-3
"""Sizes: the edge of the room, the length of the screw."""

PLACES = (0.0, 0.1, 10.0, 4000.0)
"""Distances of the screw from the middle of the room."""

WIDE = FloatFormat(8, 23)
PIXELS = 32
AROUND, UP = 16, 48
THREADS = 6


def screw(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A closed screw of length 1 along z, around 0, turned to no axis: a thread and a head."""
    angle, z = np.meshgrid(2 * np.pi * np.arange(AROUND) / AROUND, np.linspace(-0.5, 0.5, UP))
    thread = 0.09 * (1 + 0.25 * np.cos(angle - 2 * np.pi * THREADS * z))
    radius = np.where(z > 0.4, 0.2, thread)
    rings = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1).reshape(-1, 3)
    i, j = (x.ravel() for x in np.meshgrid(np.arange(UP - 1), np.arange(AROUND), indexing="ij"))
    here, right = i * AROUND + j, i * AROUND + (j + 1) % AROUND
    belt = np.stack([here, right, right + AROUND, here, right + AROUND, here + AROUND], axis=1)
    j = np.arange(AROUND)
    ends = [
        np.stack([np.full(AROUND, len(rings) + end), ring + j, ring + (j + 1) % AROUND], axis=1)
        for end, ring in enumerate((0, (UP - 1) * AROUND))
    ]
    vertices = np.concatenate([rings, [(0, 0, -0.5), (0, 0, 0.5)]])
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return vertices @ turn, np.concatenate([belt.reshape(-1, 3), *ends]).astype(np.int32)


def room(makers: dict[str, Make], fmt: FloatFormat, rng: np.random.Generator) -> list[dict]:
    """Rays that see the wrong one of screw and walls, in this format and in one of 32 bits.

    Kept: rays that see the screw and should, over rays that do or should.
    """
    return [
        _row(f"{place:g} off the middle{suffix}", some, place, rng)
        for some, suffix in ((makers, ""), (systems(WIDE, False), f", {WIDE}"))
        for place in PLACES
        if not suffix or fmt != WIDE
    ]


def _row(name: str, makers: dict[str, Make], place: float, rng: np.random.Generator) -> dict:
    walls, wall_faces = cube(1)
    points, faces = screw(rng)
    middle = place * unit(np.array([3.0, 2.0, 1.0]))
    vertices = np.concatenate([walls * ROOM / 2, points * SCREW + middle])
    both = np.concatenate([wall_faces, faces + len(walls)])

    eye = middle + 2 * SCREW * unit(np.array([1.0, -2.0, 2.0]))
    right = unit(np.cross(middle - eye, (0.0, 0.0, 1.0)))
    down = np.cross(unit(middle - eye), right)
    x, y = np.meshgrid(*2 * [np.linspace(-0.35, 0.35, PIXELS)])
    directions = unit(unit(middle - eye) + x[..., None] * right + y[..., None] * down)
    directions = directions.reshape(-1, 3)
    origins = eye[None].repeat(len(directions), axis=0)
    zero = np.zeros(len(directions))
    true = trace(vertices, both, origins, directions, zero, zero + np.inf).triangle
    true_screw = true >= len(wall_faces)

    def measure(make: Make) -> Counts:
        tracer = make(vertices, both)
        found = tracer.first(tracer.points(origins), tracer.directions(directions)).triangle
        seen = found >= len(wall_faces)
        kept = len(np.unique(tracer.vertices[len(walls) :], axis=0))
        return {
            "wrong": int((seen != true_screw).sum()),
            "triangle": int((found != true).sum()),
            "lost": int((found < 0).sum()),
            "seen": int((seen & true_screw).sum()),
            "vertices": kept,
        }

    def verdict(ours: Counts) -> tuple[bool, str]:
        union = true_screw.sum() + ours["wrong"] - (true_screw.sum() - ours["seen"])
        return True, f"{ours['seen'] / union:.0%} kept"

    return row(name, len(directions), makers, measure, verdict, ("wrong",))
