"""Closed meshes from inside: a ray that hits nothing is lost."""

from collections.abc import Callable
from functools import cache

import numpy as np

from sim.study.stability.rows import Counts, none, power, row
from sim.study.stability.shapes import ball, edges_of, icosphere, middles, unit
from sim.study.stability.tracers import Make, Tracer

CUTS = 6
"""A sphere of 81,920 triangles, 40,962 vertices and 122,880 edges."""

INSIDE = 0.5
"""Radius of the ball, in the unit sphere, in which rays begin."""

MOVES = (1e3, 1e4, 1e5, 1e6)
SCALES = (1e-18, 1e-6, 1e6, 1e15, 1e18)


def closed(makers: dict[str, Make], rng: np.random.Generator, cuts: int = CUTS) -> list[dict]:
    """Rays at vertices and edges, from the middle and from points all around it."""
    sphere = icosphere(cuts)
    return [
        *_rows("from middle", makers, sphere, rng, 0.0),
        *_rows("from inside", makers, sphere, rng),
    ]


def moved(makers: dict[str, Make], rng: np.random.Generator, cuts: int = CUTS) -> list[dict]:
    """The same where mesh and rays lie far from the origin."""
    return _placed(makers, rng, cuts, {f"+ {power(by)}": {"shift": by} for by in MOVES})


def scaled(makers: dict[str, Make], rng: np.random.Generator, cuts: int = CUTS) -> list[dict]:
    """The same where mesh and rays are large or small."""
    return _placed(makers, rng, cuts, {f"x {power(by)}": {"scale": by} for by in SCALES})


def _placed(makers, rng, cuts: int, places: dict[str, dict[str, float]]) -> list[dict]:
    sphere = icosphere(cuts)
    return [
        each for name, place in places.items() for each in _rows(name, makers, sphere, rng, **place)
    ]


def _rows(name, makers, mesh, rng, radius=INSIDE, scale=1.0, shift=0.0) -> list[dict]:
    """A row of rays at vertices and one at edges, from points in a ball."""
    vertices, faces = mesh
    counts = len(vertices), len(edges_of(faces)[0])
    origins = [ball(rng, count, radius) * scale + shift for count in counts]

    @cache
    def tracer(make: Make) -> Tracer:
        return make(vertices * scale + shift, faces)

    def measured(kind: int) -> Callable[[Make], Counts]:
        return lambda make: lost(tracer(make), targets(tracer(make), faces, kind), origins[kind])

    return [
        row(f"{target}, {name}", counts[kind], makers, measured(kind), none("lost"))
        for kind, target in enumerate(("vertices", "edges"))
    ]


def targets(tracer: Tracer, faces: np.ndarray, kind: int) -> np.ndarray:
    """Vertices (kind 0) or midpoints of edges (1) as a tracer holds them."""
    return middles(tracer.vertices, faces) if kind else tracer.vertices


def lost(tracer: Tracer, targets: np.ndarray, origins: np.ndarray) -> Counts:
    """Rays lost, each aimed at what the tracer holds, from an origin of the user."""
    starts = tracer.points(origins)
    found = tracer.first(starts, aimed(tracer, starts, targets))
    return {"lost": int((found.triangle < 0).sum())}


def aimed(tracer: Tracer, starts: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Directions (n, 3) as a tracer holds them, of length 1; 0 where rounding made both one."""
    with np.errstate(invalid="ignore"):
        return tracer.directions(np.nan_to_num(unit(targets - starts)))
