"""Model of hdl.rays.traversal: packets of four rays through a tree, decision for decision."""

from dataclasses import dataclass

import numpy as np

from hdl.fp.format import FloatFormat
from hdl.rays.packet import RAYS
from sim.compiler.order import Order
from sim.model.fp.order import order_key
from sim.model.rays.overflow import no_overflows
from sim.model.rays.packets import trace_bits
from sim.model.rays.setup import margin_scale, one
from sim.model.rays.transform import Instances, no_instances

COUNTERS = ("packets", "steps", "tests", "ray_tests", "pushes", "pops", "deepest", "entries")
OVERFLOWS = ("setup", "planes", "triangles", "transform")


@dataclass(frozen=True)
class Hits:
    """Hit records, one a ray.

    Attributes
    ----------
    t, u, v : (n,) int64 bit patterns
        t is in directions, u and v weigh vertices 1 and 2; where nothing was hit, t is t_max.
    triangle : (n,) int64
        Triangle record, or NO_TRIANGLE.
    instance : (n,) int64
        Leaf record through which the ray entered the triangle's object, or NO_TRIANGLE.
    counters : dict
        packets, steps (packets at nodes), tests (packets at leaves), ray_tests (rays of those at
        triangles that were still in question), pushes, pops, deepest (most entries on one stack),
        entries (packets at instances).
    overflows : dict
        Of setup, planes, triangles and, with instances, transform, whether finite numbers became
        infinite there.
    """

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray
    instance: np.ndarray
    counters: dict[str, int]
    overflows: dict[str, bool]


def trace(
    fmt: FloatFormat,
    order: Order,
    bounds: np.ndarray,
    corners: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    t_min: np.ndarray,
    t_max: np.ndarray,
    *,
    stack_depth: int = 64,
    margin: int | None = None,
    root: int | None = None,
    instances: Instances | None = None,
) -> Hits:
    """First hits of rays in packets of four, in their order. All numbers are bit patterns.

    From the root on: each ray's interval is clipped against the bounds of both children, and
    that by its hit so far. A child that no ray of the packet reaches is left out. If both are
    reached, the one that the first ray in both enters first goes first (the left one, if equal or
    if no ray is in both); the other waits on the stack. Of hits with equal t the lower triangle
    counts, and t_min <= t <= t_max. (Woop, Marmitt, Slusallek 2006, traversal of B-KD trees.)

    At an instance the rays in question go on at the root of its object, in the frame of that and
    from t_min to t_max again, with their hits so far. Of hits with equal t that of the lower
    instance counts, that of a triangle in the world last.

    Parameters
    ----------
    fmt : FloatFormat
    order : Order
    bounds : (N, 4) int64
    corners : (L, 3, 3) int64
        Coordinates of the corners of each leaf; of an instance they do not matter.
    origins, directions : (n, 3) int64
        n is a multiple of 4. A ray with t_min above t_max is not there.
    t_min, t_max : (n,) int64
    stack_depth : int
    margin : int
        Pattern, as of hdl.records.scene; that which rounding asks for, if it is not given.
    root : int
        The node at which packets begin; the last one, if it is not given.
    instances : Instances
        Those among the leaves; none, if it is not given. No leaf of an object is one.
    """
    rays = len(origins)
    if rays % RAYS:
        raise ValueError(f"{rays} rays are no whole number of packets of {RAYS}")
    hits = np.empty((rays, 5), np.int64)
    of = no_instances(len(corners)) if instances is None else instances
    counts = np.zeros(len(COUNTERS), np.int64)
    overflows = no_overflows()
    trace_bits(
        fmt.exp_bits,
        fmt.man_bits,
        one(fmt),
        margin_scale(fmt) if margin is None else margin,
        order.children,
        order.axis,
        bounds,
        corners,
        of.of_leaf,
        of.rows,
        of.roots,
        len(order.children) - 1 if root is None else root,
        origins,
        directions,
        np.stack([t_min, t_max], axis=1),
        np.stack([order_key(fmt, t_min), order_key(fmt, t_max)], axis=1),
        hits,
        counts,
        overflows,
        stack_depth,
    )
    counters: dict[str, int] = dict(zip(COUNTERS, counts.tolist(), strict=True))
    infinite: dict[str, bool] = dict(zip(OVERFLOWS, overflows.tolist(), strict=True))
    if instances is None:
        del infinite["transform"]
    t, u, v, triangle, instance = hits.T
    return Hits(t, u, v, triangle, instance, counters, infinite)
