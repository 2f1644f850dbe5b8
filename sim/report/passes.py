"""Rays cast at once: what they cost in the Verilog, and whether model and oracle agree."""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from sim.cosim.stage import Cast, Stage
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays
from sim.model.rays.setup import ROUNDING_ULPS
from sim.model.rays.traversal import NO_TRIANGLE, trace
from sim.oracle.classify import CLASSES, Taxonomy, classify
from sim.oracle.trace import trace as trace_exactly

HIT_FIELDS = ("t", "u", "v", "triangle")
COUNTED = ("steps", "tests", "ray_tests", "pushes", "pops")
"""Counters of the hardware that the model has too."""
SHOWN = 10
"""Mismatches that a report describes."""


@dataclass
class Pass:
    """Figures of rays cast at once. Cycles are of the Verilog.

    Attributes
    ----------
    name : str
    rays, hits : int
        Rays that are there, and those of them that hit.
    cycles : int
    counters : dict
        packets, steps, tests, ray_tests, pushes, pops.
    waits : dict
        Cycles without a step, by cause.
    cache : dict
        hits and misses, of nodes and of geometry.
    expected : dict of (n,) int64
        Hit records of the model.
    mismatches : int
        Hit records and counters that are not the model's.
    shown : list of str
    oracle : dict
        Counts of sim.oracle.classify.CLASSES; rays unexplained; of the others the
        largest share of what rounding may do.
    model_seconds : float
    """

    name: str
    rays: int
    hits: int
    cycles: int
    counters: dict[str, int]
    waits: dict[str, int]
    cache: dict[str, dict[str, int]]
    expected: dict[str, np.ndarray]
    mismatches: int
    shown: list[str]
    oracle: dict
    model_seconds: float


def check_pass(name: str, stage: Stage, rays: Rays, cast: Cast) -> Pass:
    """Trace rays that the Verilog has traced again, by the model and by the float64 oracle.

    The oracle sees the very mesh and rays that the machine sees, so it judges the arithmetic of
    the ray path and not the rounding of the scene.
    """
    prepared = stage.prepared
    fmt, order = prepared.config.fmt, prepared.image.order
    corners = stage.bits[prepared.leaf_vertices]
    limits = rays.t_min, rays.t_max
    begin = perf_counter()
    traced = trace(fmt, order, stage.bounds, corners, rays.origins, rays.directions, *limits)
    model_seconds = perf_counter() - begin
    expected = {field: getattr(traced, field) for field in HIT_FIELDS}

    counters = cast.counters["cast"]
    wrong = np.flatnonzero(
        np.any([cast.hits[f] != expected[f] for f in HIT_FIELDS], axis=0)
    ).tolist()
    shown = [f"{name} ray {k}: {_difference(cast.hits, expected, k)}" for k in wrong[:SHOWN]]
    off = [key for key in COUNTED if counters[key] != traced.counters[key]]
    shown += [f"{name} {key}: {counters[key]}, not {traced.counters[key]}" for key in off]

    taxonomy = judge(stage, rays, cast.hits)
    shown += [
        f"{name} ray {k}: rounding does not explain its hit" for k in taxonomy.unexplained_rays
    ]
    there = decode(fmt, rays.t_min) <= decode(fmt, rays.t_max)
    return Pass(
        name=name,
        rays=int(there.sum()),
        hits=int((cast.hits["triangle"] != NO_TRIANGLE).sum()),
        cycles=counters["steps"] + sum(counters["waits"].values()),
        counters={key: counters[key] for key in ("packets", *COUNTED)},
        waits=counters["waits"],
        cache={kind: cast.counters[kind] for kind in ("nodes", "geometry")},
        expected=expected,
        mismatches=len(wrong) + len(off),
        shown=shown,
        oracle={
            **taxonomy.counts,
            "unexplained": taxonomy.unexplained,
            "largest_movement": taxonomy.largest_movement,
        },
        model_seconds=model_seconds,
    )


def in_all(passes: Sequence[Pass]) -> Pass:
    """Sums over passes; of errors the largest."""

    def total(dicts):
        return {key: sum(d[key] for d in dicts) for key in dicts[0]}

    oracles = [p.oracle for p in passes]
    return Pass(
        name="all",
        rays=sum(p.rays for p in passes),
        hits=sum(p.hits for p in passes),
        cycles=sum(p.cycles for p in passes),
        counters=total([p.counters for p in passes]),
        waits=total([p.waits for p in passes]),
        cache={kind: total([p.cache[kind] for p in passes]) for kind in passes[0].cache},
        expected={f: np.concatenate([p.expected[f] for p in passes]) for f in HIT_FIELDS},
        mismatches=sum(p.mismatches for p in passes),
        shown=[line for p in passes for line in p.shown][:SHOWN],
        oracle={
            **{key: sum(o[key] for o in oracles) for key in (*CLASSES, "unexplained")},
            "largest_movement": max(o["largest_movement"] for o in oracles),
        },
        model_seconds=sum(p.model_seconds for p in passes),
    )


def _difference(found: dict[str, np.ndarray], expected: dict[str, np.ndarray], ray: int) -> str:
    """The fields in which a hit record is not the model's, as raw bits."""
    pairs = ((f, int(found[f][ray]), int(expected[f][ray])) for f in HIT_FIELDS)
    return ", ".join(f"{f} {got:x}, not {want:x}" for f, got, want in pairs if got != want)


def judge(stage: Stage, rays: Rays, hits: dict[str, np.ndarray]) -> Taxonomy:
    """Hits against those of exact arithmetic on the same mesh and rays."""
    prepared = stage.prepared
    fmt = prepared.config.fmt
    vertices, faces = decode(fmt, stage.bits), prepared.leaf_vertices
    origins, directions = decode(fmt, rays.origins), decode(fmt, rays.directions)
    limits = decode(fmt, rays.t_min), decode(fmt, rays.t_max)
    truth = trace_exactly(vertices, faces, origins, directions, *limits)
    # The largest distance from a ray's origin to a vertex, on an axis; the scene lies in [-1, 1].
    reach = 1 + np.abs(origins).max(axis=1)
    half_ulp = 2.0 ** -(fmt.man_bits + 1)
    triangle = hits["triangle"]
    return classify(
        vertices,
        faces,
        origins,
        directions,
        *limits,
        found_t=decode(fmt, hits["t"]),
        found_triangle=np.where(triangle == NO_TRIANGLE, -1, triangle),
        truth=truth,
        rounded_t=decode(fmt, encode(fmt, truth.t)),
        rounding=np.sqrt(3) * ROUNDING_ULPS * half_ulp * reach,
    )
