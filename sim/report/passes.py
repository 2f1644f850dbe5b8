"""Rays cast at once: what they cost in the Verilog, and whether model and oracle agree."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np

from hdl.fp.format import FloatFormat
from sim.cosim.stage import Cast, Stage
from sim.model.fp.format import decode, encode
from sim.model.fp.order import order_key
from sim.model.rays.camera import Rays
from sim.model.rays.traversal import NO_TRIANGLE
from sim.oracle.classify import CLASSES, Taxonomy, classify
from sim.oracle.trace import trace as trace_exactly
from sim.prepare import Prepared
from sim.report.mismatch import SHOWN

SURFACE = ("triangle", "instance")
"""Fields of a hit that say what it lies on."""

COUNTED = ("steps", "tests", "ray_tests", "pushes", "pops")
"""Counters of the hardware that the model has too."""


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
    model : dict
        Hit records by how they differ from the model's: counts of CLASSES.
    mismatches : int
        Hit records and counters that are not the model's.
    shown : list of str
    overflows : dict
        For each place of hdl.rays.caster.overflows, if finite numbers became infinite there.
    oracle : Taxonomy
    model_seconds : float
    """

    name: str
    rays: int
    hits: int
    cycles: int
    counters: dict[str, int]
    waits: dict[str, int]
    cache: dict[str, dict[str, int]]
    model: dict[str, int]
    mismatches: int
    shown: list[str]
    overflows: dict[str, bool]
    oracle: Taxonomy
    model_seconds: float


def check_pass(name: str, stage: Stage, rays: Rays, cast: Cast) -> Pass:
    """Trace rays that the Verilog has traced again, by the model and by the float64 oracle.

    The oracle sees the very mesh and rays that the machine sees, so it judges the arithmetic of
    the ray path and not the rounding of the scene.
    """
    prepared = stage.pose.prepared
    fmt = prepared.config.fmt
    begin = perf_counter()
    traced = stage.model(rays)
    model_seconds = perf_counter() - begin
    expected = traced.fields(prepared.config)

    counters = cast.counters["cast"]
    kinds = differences(fmt, cast.hits, expected)
    wrong = np.flatnonzero(kinds).tolist()
    shown = [f"{name} ray {k}: {_difference(cast.hits, expected, k)}" for k in wrong[:SHOWN]]
    off = [key for key in COUNTED if counters[key] != traced.counters[key]]
    shown += [f"{name} {key}: {counters[key]}, not {traced.counters[key]}" for key in off]

    places = {"camera": rays.overflow, **traced.overflows}
    counted = cast.counters["overflows"]
    overflows = {name: bool(counted[name]) for name in places if name in counted}
    wrongly = [name for name in overflows if overflows[name] != places[name]]
    shown += [f"{name} overflow: {overflows[name]}, not {places[name]}" for name in wrongly]

    taxonomy = judge(stage.pose.prepared, stage.pose.vertices, rays, cast.hits)
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
        model=class_counts(kinds),
        mismatches=len(wrong) + len(off) + len(wrongly),
        shown=shown,
        overflows=overflows,
        oracle=taxonomy,
        model_seconds=model_seconds,
    )


def total(figures: Sequence[Mapping[str, int]]) -> dict[str, int]:
    """Sums of figures of the same names."""
    return {name: sum(of[name] for of in figures) for name in figures[0]}


def oracle_figures(taxonomies: Sequence[Taxonomy]) -> dict:
    """Of several passes: counts of CLASSES, rays unexplained, and of all the largest movement."""
    figures = [taxonomy.as_dict() for taxonomy in taxonomies]
    movements = [of["largest_movement"] for of in figures]
    return {
        **total([of["counts"] for of in figures]),
        "unexplained": sum(of["unexplained"] for of in figures),
        "largest_movement": None if None in movements else max(movements),
    }


def differences(
    fmt: FloatFormat, found: dict[str, np.ndarray], expected: dict[str, np.ndarray]
) -> np.ndarray:
    """How hit records differ: the index into CLASSES (n,) of each, decided on bits."""
    same = np.all([found[f] == expected[f] for f in found], axis=0)
    t, expected_t = (order_key(fmt, hits["t"]) for hits in (found, expected))
    hit, expected_hit = (hits["triangle"] != NO_TRIANGLE for hits in (found, expected))
    return np.select(
        [
            same,
            np.all([found[f] == expected[f] for f in SURFACE if f in found], axis=0),
            hit & expected_hit & (t == expected_t),
            ~hit & expected_hit,
            hit & ~expected_hit,
            t < expected_t,
        ],
        range(len(CLASSES) - 1),
        len(CLASSES) - 1,
    )


def class_counts(kinds: np.ndarray) -> dict[str, int]:
    """Hit records of each of CLASSES."""
    return {name: int((kinds == kind).sum()) for kind, name in enumerate(CLASSES)}


def _difference(found: dict[str, np.ndarray], expected: dict[str, np.ndarray], ray: int) -> str:
    """The fields in which a hit record is not the model's, as raw bits."""
    pairs = ((f, int(found[f][ray]), int(expected[f][ray])) for f in found)
    return ", ".join(f"{f} {got:x}, not {want:x}" for f, got, want in pairs if got != want)


def judge(
    prepared: Prepared,
    vertices: np.ndarray,
    rays: Rays,
    hits: dict[str, np.ndarray],
    *,
    moved: float = 0.0,
) -> Taxonomy:
    """Hits against those of exact arithmetic on a mesh of vertices (V, 3), and the same rays.

    `moved` is how far from there the machine's vertices may be.
    """
    fmt, faces = prepared.config.fmt, prepared.surface_faces
    origins, directions = decode(fmt, rays.origins), decode(fmt, rays.directions)
    limits = decode(fmt, rays.t_min), decode(fmt, rays.t_max)
    truth = trace_exactly(vertices, faces, origins, directions, *limits)
    # The largest distance from a ray's origin to a vertex, on an axis; the scene lies in [-1, 1].
    reach = 1 + np.abs(origins).max(axis=1)
    half_ulp = 2.0 ** -(fmt.man_bits + 1)
    return classify(
        vertices,
        faces,
        origins,
        directions,
        *limits,
        found_t=decode(fmt, hits["t"]),
        found_triangle=prepared.surfaces(hits),
        truth=truth,
        rounded_t=decode(fmt, encode(fmt, truth.t)),
        rounding=np.sqrt(3) * prepared.rounding * half_ulp * reach + moved,
    )
