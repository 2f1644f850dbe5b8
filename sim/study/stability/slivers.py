"""Slivers at grazing angles: which decisions rounding turns."""

from collections.abc import Sequence
from functools import cache

import numpy as np

from hdl.fp.format import FloatFormat
from sim.study.stability import exact
from sim.study.stability.bound import share, sheared
from sim.study.stability.rows import Counts, power, row
from sim.study.stability.shapes import unit, units
from sim.study.stability.tracers import Make, Tracer

CASES = 1000
GRAZING = (1e-2, 1e-3, 1e-4)
"""Sine of the angle between ray and plane."""

ASPECTS = (1e2, 1e6)
"""Length over width: from and to, even in the logarithm."""

AWAY = 2.0
"""Lengths of a sliver between the origin of a ray and where it passes the sliver."""

Case = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Corners (3, 3), origin (3,) and direction (3,) of a triangle and a ray."""

ONE = np.array([[0, 1, 2]], np.int32)


def sliver(rng: np.random.Generator, grazing: float) -> Case:
    """A sliver of length 1 and a ray that passes it as near as it is wide, one of two outside.

    The ray's angle to the long side, in the plane, is even in the logarithm from 1e-3 on: one
    that runs along a sliver is the farther from its edges.
    """
    width = 10 ** -rng.uniform(*np.log10(ASPECTS))
    along, side = units(rng, 2)
    side = unit(np.cross(along, side))
    corners = np.array([-0.5 * along, 0.5 * along, rng.uniform(-0.4, 0.4) * along + width * side])
    place = rng.uniform(-0.3, 0.3)
    passes = place * along + rng.uniform(-0.5, 1.0) * width * side
    angle = 10 ** rng.uniform(-3, np.log10(np.pi / 2))
    flat = np.cos(angle) * along + np.sin(angle) * side
    direction = np.sqrt(1 - grazing**2) * flat + grazing * np.cross(along, side)
    return corners, passes - AWAY * direction, direction


def near_edge(rng: np.random.Generator, fmt: FloatFormat) -> Case:
    """A triangle of any shape and a ray that passes one of its edges within about the bound."""
    corners = rng.uniform(-1, 1, (3, 3))
    origin, weight = AWAY * units(rng, 1)[0], rng.random()
    edge = weight * corners[0] + (1 - weight) * corners[1]
    reach = float(np.abs(corners - origin).max())
    target = edge + sheared(fmt, reach) * rng.normal(size=3)
    return corners, origin, unit(target - origin)


def slivers(
    makers: dict[str, Make], fmt: FloatFormat, rng: np.random.Generator, cases: int = CASES
) -> list[dict]:
    """Two rows for each angle: exact decisions about what a system holds, and about the original.

    Of what ours holds, no decision may be wrong farther from an edge than the bound.
    """
    drawn = {f"at {power(angle)}": [sliver(rng, angle) for _ in range(cases)] for angle in GRAZING}
    drawn["near edges"] = [near_edge(rng, fmt) for _ in range(cases)]
    return [each for name, of in drawn.items() for each in _judged(name, makers, fmt, of)]


def _judged(
    name: str, makers: dict[str, Make], fmt: FloatFormat, cases: Sequence[Case]
) -> list[dict]:

    def measured(make: Make) -> tuple[Counts, Counts]:
        return decisions(make, fmt, cases)

    both = cache(measured)
    rows = (("held", 0, within_bound), ("given", 1, wrong))
    return [
        row(
            f"{name}, as {seen}",
            len(cases),
            makers,
            lambda make, part=part: both(make)[part],
            judge,
            SHOWN,
        )
        for seen, part, judge in rows
    ]


SHOWN = ("false_hits", "false_misses")


def within_bound(ours: Counts) -> tuple[bool, str]:
    """No decision that is farther from an edge than the bound may be wrong."""
    return ours["beyond"] == 0, f"{ours['beyond']} beyond"


def wrong(ours: Counts) -> tuple[bool, str]:
    """No decision of what was given is promised: rounding may move it."""
    return True, f"{ours['false_hits'] + ours['false_misses']} wrong"


def decisions(make: Make, fmt: FloatFormat, cases: Sequence[Case]) -> tuple[Counts, Counts]:
    """Wrong decisions about triangles alone in their scenes: as held, and as given.

    false_hits and false_misses; as held, `clear` counts decisions farther from an edge than the
    bound of `fmt`, `beyond` the wrong ones among them, and `farthest` is the distance of the
    farthest wrong one, in percent of the bound.
    """
    held = dict.fromkeys((*SHOWN, "clear", "beyond", "farthest"), 0)
    given = dict.fromkeys(SHOWN, 0)
    for corners, origin, direction in cases:
        tracer = make(corners, ONE)
        ray = tracer.points(origin[None])[0], tracer.directions(direction[None])[0]
        hit = _hit(tracer, *ray)
        true = exact.hits(tracer.vertices, *ray)
        distance = share(fmt, tracer.vertices, *ray)
        held["clear"] += distance > 1
        if hit != true:
            held["beyond"] += distance > 1
            held["farthest"] = max(held["farthest"], int(np.ceil(100 * distance)))
        for counts, expected in ((held, true), (given, exact.hits(corners, origin, direction))):
            counts["false_hits"] += hit and not expected
            counts["false_misses"] += expected and not hit
    return {k: int(v) for k, v in held.items()}, {k: int(v) for k, v in given.items()}


def _hit(tracer: Tracer, origin: np.ndarray, direction: np.ndarray) -> bool:
    return bool(tracer.first(origin[None], direction[None]).triangle[0] >= 0)
