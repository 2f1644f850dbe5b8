"""Triangles without area, edge-on or coincident; rays along axes and from surfaces."""

from itertools import product

import numpy as np

from hdl.fp.format import FloatFormat
from sim.study.stability.rows import Counts, none, row
from sim.study.stability.shapes import ball, cube, icosphere, middles, unit, units
from sim.study.stability.slivers import SHOWN, Case, decisions, within_bound
from sim.study.stability.tracers import Make

CASES = 1000
STEP = 2.0**-8
"""Coordinates are whole multiples of it, so that a format of 10 bits holds them exactly."""

CUTS = 4
"""A sphere of 5,120 triangles."""

CELLS = 8


def degenerate(
    makers: dict[str, Make],
    fmt: FloatFormat,
    rng: np.random.Generator,
    cases: int = CASES,
    cuts: int = CUTS,
) -> list[dict]:
    """Cases on which the definition of a hit decides: no area and edge-on are no hit."""
    return [
        *(
            _undefined(name, makers, fmt, [draw(rng) for _ in range(cases)], never)
            for name, draw, never in (
                ("corners coincide", _point, True),
                ("edge-on, axis plane", _axial, True),
                ("corners in a line", _line, False),
                ("edge-on", _slanted, False),
            )
        ),
        *_coincident(makers, rng, cuts),
        _along_axes(makers, rng),
        *_from_surface(makers, rng, cuts),
    ]


def _lattice(rng: np.random.Generator, *shape: int) -> np.ndarray:
    """Multiples of STEP in (-1/2, 1/2)."""
    most = int(0.5 / STEP) - 1
    return STEP * rng.integers(-most, most, shape, endpoint=True)


def _point(rng: np.random.Generator) -> Case:
    """Two corners, or all, are one; the ray is aimed at it or at the edge that is left."""
    corners = _lattice(rng, 3, 3)
    corners[1] = corners[0]
    if rng.random() < 0.3:
        corners[2] = corners[0]
    corners = corners[rng.permutation(3)]
    origin = _lattice(rng, 3)
    return corners, origin, corners[rng.integers(3)] - origin


def _line(rng: np.random.Generator) -> Case:
    """Corners at whole steps along a line; every other ray is aimed at the middle, or beside it."""
    middle, along = _lattice(rng, 3) / 4, _lattice(rng, 3) / 4
    corners = middle + along * rng.permutation([-1, 0, 1])[:, None]
    origin = np.rint(units(rng, 1)[0] * 2 / STEP) * STEP
    return corners, origin, middle + rng.integers(2) * _lattice(rng, 3) / 4 - origin


def _axial(rng: np.random.Generator) -> Case:
    """Triangle and ray in a plane square to an axis."""
    corners, origin = _lattice(rng, 3, 3), _lattice(rng, 3)
    axis = rng.integers(3)
    corners[:, axis] = origin[axis]
    return corners, origin, corners.mean(axis=0) - origin


def _slanted(rng: np.random.Generator) -> Case:
    """Triangle and ray in a plane; every other ray goes through the middle of a side, or beside."""
    middle, along, side = _lattice(rng, 3, 3) / 4
    corners = middle + np.array([-along, along, side])
    direction = rng.integers(-2, 2, endpoint=True) * along + side
    return corners, middle + rng.integers(2) * 4 * along - 4 * direction, direction


def _undefined(name: str, makers, fmt, cases: list[Case], never: bool) -> dict:
    """A row of hits and misses against exact decisions on what a system holds.

    Either no decision may be wrong, or none farther from an edge than the bound.
    """

    def verdict(ours: Counts) -> tuple[bool, str]:
        wrong = sum(ours[k] for k in SHOWN)
        if never:
            return wrong == 0, f"{wrong} wrong"
        return within_bound(ours)

    def measure(make: Make) -> Counts:
        return decisions(make, fmt, cases)[0]

    return row(name, len(cases), makers, measure, verdict, SHOWN)


def _coincident(makers: dict[str, Make], rng: np.random.Generator, cuts: int) -> list[dict]:
    """Every triangle is there twice, or three times."""
    vertices, faces = icosphere(cuts)

    def measure(make: Make) -> Counts:
        tracer = make(vertices, np.tile(faces, (copies, 1)))
        lowest = tracer.rank.reshape(copies, -1).min(axis=0)
        centres = tracer.vertices[faces].mean(axis=1)
        origins = tracer.points(origin[None].repeat(len(faces), axis=0))
        found = tracer.first(origins, tracer.directions(unit(centres - origins)))
        hit = found.triangle >= 0
        wrong = tracer.rank[found.triangle] != lowest[found.triangle % len(faces)]
        return {"lost": int((~hit).sum()), "higher": int((hit & wrong).sum())}

    rows = []
    for copies in (2, 3):
        origin = ball(rng, 1, 0.5)[0]
        rows.append(row(f"{copies} of each triangle", len(faces), makers, measure, none("wrong")))
    return rows


def _along_axes(makers: dict[str, Make], rng: np.random.Generator) -> dict:
    """A cube of cells from inside: rays in the planes of its vertices, with zeros of both signs."""
    vertices, faces = cube(CELLS)
    inner = (2 * np.arange(1, 2 * CELLS) - 2 * CELLS) / (2.0 * CELLS)  # vertices and half-way
    lattice = np.stack(np.meshgrid(inner, inner, inner), axis=-1).reshape(-1, 3)
    origins = lattice[rng.permutation(len(lattice))[:CASES]]
    axes = [np.roll((sign, 0.0, 0.0), axis) for axis in range(3) for sign in (1.0, -1.0)]

    def measure(make: Make) -> Counts:
        tracer = make(vertices, faces)
        starts, lost, differ = tracer.points(origins), 0, 0
        for axis in axes:
            found = []
            for signs in product((1.0, -1.0), repeat=2):
                direction = axis.copy()
                direction[axis == 0] = np.copysign(0.0, signs)
                directions = tracer.directions(direction[None].repeat(len(starts), axis=0))
                found.append(tracer.first(starts, directions))
                lost += int((found[-1].triangle < 0).sum())
                differ += int((found[-1].triangle != found[0].triangle).sum())
        return {"lost": lost, "differ": differ}

    count = 4 * len(axes) * len(origins)
    return row("along axes, +0 and -0", count, makers, measure, none("wrong"))


def _from_surface(makers: dict[str, Make], rng: np.random.Generator, cuts: int) -> list[dict]:
    """Rays that begin at a vertex have t = 0; those that go inwards from a side hit something."""
    vertices, faces = icosphere(cuts)
    directions, targets = units(rng, len(vertices)), ball(rng, 3 * len(faces) // 2, 0.5)

    def at_vertices(make: Make) -> Counts:
        tracer = make(vertices, faces)
        found = tracer.first(tracer.vertices, tracer.directions(directions))
        hit = found.triangle >= 0
        return {"lost": int((~hit).sum()), "later": int((hit & (found.t != 0)).sum())}

    def inwards(make: Make) -> Counts:
        tracer = make(vertices, faces)
        held = tracer.vertices
        starts = tracer.directions(middles(held, faces))  # rounded, where they are
        inner = tracer.points(targets)
        found = tracer.first(starts, tracer.directions(unit(inner - starts)))
        return {"lost": int((found.triangle < 0).sum())}

    return [
        row("from vertices: t = 0", len(vertices), makers, at_vertices, none("wrong")),
        row("from edges inwards", len(targets), makers, inwards, none("lost")),
    ]
