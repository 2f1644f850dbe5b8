"""The ends of the formats: largest and smallest coordinates, directions and t."""

import numpy as np

from hdl.fp.format import FloatFormat
from sim.study.stability.closed import INSIDE, aimed, lost
from sim.study.stability.rows import Counts, none, power, row
from sim.study.stability.shapes import ball, cube, icosphere, units
from sim.study.stability.tracers import Make

CUTS = 4
"""A sphere of 5,120 triangles."""

LENGTHS = (1e-18, 1e-12, 1e-6, 1e6, 1e12, 1e18)
FLOAT64 = (1e-320, 1e-310, 1e307)
"""Sizes at the ends of what a user can give: two among subnormal numbers."""

ABOVE = (1, 8, 16, 32)
"""Sizes, in powers of two above the smallest normal number of the format."""

TINY = 2
"""Cuts of a tiny sphere: the machine's margin makes every ray meet all of its triangles."""


def ends(
    makers: dict[str, Make], fmt: FloatFormat, rng: np.random.Generator, cuts: int = CUTS
) -> list[dict]:
    """Coordinates, then directions, then what is no number."""
    return [
        _largest(makers, rng),
        *(_source(makers, rng, scale, cuts) for scale in FLOAT64),
        *(_smallest(makers, rng, fmt, above) for above in ABOVE),
        *(_directed(f"directions of {power(x)}", makers, rng, x, cuts) for x in LENGTHS),
        _directed(f"directions of 2^{fmt.min_exp}", makers, rng, 2.0**fmt.min_exp, cuts),
        _directed(f"directions of 2^{fmt.max_exp}", makers, rng, 2.0**fmt.max_exp, cuts),
        _zero(makers, rng, cuts),
        *(_refused(makers, number) for number in (np.inf, np.nan)),
    ]


def _largest(makers: dict[str, Make], rng: np.random.Generator) -> dict:
    """A cube all of whose vertices have a coordinate of exactly 1, from inside."""
    vertices, faces = cube(32)
    origins = ball(rng, len(vertices), INSIDE)

    def measure(make: Make) -> Counts:
        tracer = make(vertices, faces)
        moved = int((tracer.vertices != vertices).any(axis=1).sum())
        return {**lost(tracer, tracer.vertices, origins), "moved": moved}

    return row("coordinates of +-1", len(vertices), makers, measure, none("lost"), ("lost",))


def _source(makers: dict[str, Make], rng, scale: float, cuts: int) -> dict:
    """A sphere at the ends of float64, from inside."""
    vertices, faces = icosphere(cuts)
    origins = ball(rng, len(vertices), INSIDE)

    def measure(make: Make) -> Counts:
        tracer = make(vertices * scale, faces)
        return lost(tracer, tracer.vertices, origins * scale)

    return row(f"float64 of {power(scale)}", len(vertices), makers, measure, none("lost"))


def _smallest(makers: dict[str, Make], rng, fmt: FloatFormat, above: int) -> dict:
    """A tiny sphere in a cube, from inside: what it does not stop is lost."""
    walls, wall_faces = cube(1)
    size = 2.0 ** (fmt.min_exp + above)
    points, faces = icosphere(TINY)
    vertices = np.concatenate([walls, points * size])
    both = np.concatenate([wall_faces, faces + len(walls)])
    origins = ball(rng, len(points), INSIDE) * size

    def measure(make: Make) -> Counts:
        tracer = make(vertices, both)
        starts = tracer.points(origins)
        found = tracer.first(starts, aimed(tracer, starts, tracer.vertices[len(walls) :]))
        return {"lost": int((found.triangle < len(wall_faces)).sum())}

    def verdict(ours: Counts) -> tuple[bool, str]:
        return True, f"{ours['lost']} lost"

    return row(f"sphere of 2^{fmt.min_exp + above}", len(points), makers, measure, verdict)


def _spheres(cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """A sphere in a sphere; the first half of the triangles are of the inner one."""
    vertices, faces = icosphere(cuts)
    return np.concatenate([vertices / 2, vertices]), np.concatenate([faces, faces + len(vertices)])


def _directed(name: str, makers: dict[str, Make], rng, length: float, cuts: int) -> dict:
    """Directions of some length as the machine gets them, in a sphere in a sphere."""
    vertices, faces = _spheres(cuts)
    origins, directions = ball(rng, len(faces), 0.25), units(rng, len(faces)) * length

    def measure(make: Make) -> Counts:
        tracer = make(vertices, faces)
        found = tracer.first(tracer.points(origins), tracer.directions(directions))
        inner = found.triangle < len(faces) // 2
        hit = found.triangle >= 0
        return {"lost": int((~hit).sum()), "behind": int((hit & ~inner).sum())}

    def verdict(ours: Counts) -> tuple[bool, str]:
        return True, f"{sum(ours.values())} wrong"

    return row(name, len(faces), makers, measure, verdict)


def _zero(makers: dict[str, Make], rng, cuts: int) -> dict:
    """Directions that are all zero."""
    vertices, faces = _spheres(cuts)
    origins = ball(rng, len(faces), 0.25)

    def measure(make: Make) -> Counts:
        tracer = make(vertices, faces)
        found = tracer.first(tracer.points(origins), np.zeros_like(origins))
        return {"hits": int((found.triangle >= 0).sum())}

    def verdict(ours: Counts) -> tuple[bool, str]:
        return True, f"{ours['hits']} hits"

    return row("directions of 0", len(faces), makers, measure, verdict)


def _refused(makers: dict[str, Make], number: float) -> dict:
    """A vertex that is no number: whoever takes it is asked for hits of the rest of a cube."""
    vertices, faces = cube(4)
    vertices[7, 1] = number
    origins = np.zeros_like(vertices)

    def measure(make: Make) -> Counts:
        tracer = make(vertices, faces)
        found = tracer.first(tracer.points(origins), tracer.directions(np.nan_to_num(vertices)))
        return {"lost": int((found.triangle < 0).sum())}

    return row(f"a vertex at {number}", len(vertices), makers, measure, none("accepted"))
