"""Model of hdl.rays.traversal: packets of four rays through a tree, decision for decision."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from hdl.config import Config
from hdl.fp.format import FloatFormat
from hdl.rays.packet import NO_TRIANGLE, RAYS, hit
from sim.compiler.order import Order
from sim.model.fp.order import order_key
from sim.model.rays.overflow import no_overflows
from sim.model.rays.planes import clip_bits, key_bits
from sim.model.rays.setup import COLUMNS, margin_scale, one, setup_bits
from sim.model.rays.transform import Instances, no_instances, transform_bits
from sim.model.rays.triangle import intersect_bits

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
        Leaf of the instance that the triangle is in, or NO_TRIANGLE.
    counters : dict
        packets, steps (packets at nodes), tests (packets at leaves), ray_tests (rays that were
        still in question at triangles), pushes, pops, deepest (most entries on one stack), entries
        (packets that entered an instance).
    overflows : dict
        Of setup, planes, triangles and transform, whether finite numbers became infinite there.
    """

    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray
    instance: np.ndarray
    counters: dict[str, int]
    overflows: dict[str, bool]

    def fields(self, config: Config) -> dict[str, np.ndarray]:
        """The fields of a machine's hit records."""
        return {name: getattr(self, name) for name, _ in hit(config)}


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
    instances: Instances | None = None,
    root: int | None = None,
) -> Hits:
    """First hits of rays in packets of four, in their order. All numbers are bit patterns.

    From the root on: each ray's interval is clipped against the bounds of both children, and
    that by its hit so far. A child that no ray of the packet reaches is left out. If both are
    reached, the one that the first ray in both enters first goes first (the left one, if equal or
    if no ray is in both); the other waits on the stack. Of hits with equal t the lower triangle
    counts, of those in instances the one in the lower instance, before all that are in none; and
    t_min <= t <= t_max. (Woop, Marmitt, Slusallek 2006, traversal of B-KD trees.)

    At an instance all rays of the packet are transformed, and go on at the root of its object with
    [t_min, t_max], cut by their hits so far. In the objects' trees all leaves are triangles.

    Parameters
    ----------
    fmt : FloatFormat
    order : Order
    bounds : (N, 4) int64
    corners : (L, 3, 3) int64
        Coordinates of the corners of each leaf.
    origins, directions : (n, 3) int64
        n is a multiple of 4. A ray with t_min above t_max is not there.
    t_min, t_max : (n,) int64
    stack_depth : int
    margin : int
        Pattern, as of hdl.records.scene; that which rounding asks for, if it is not given.
    instances : Instances, optional
    root : int
        The last node, if it is not given.
    """
    rays = len(origins)
    if rays % RAYS:
        raise ValueError(f"{rays} rays are no whole number of packets of {RAYS}")
    hits = np.empty((rays, 5), np.int64)
    instances = instances or no_instances(len(corners))
    counts = np.zeros(len(COUNTERS), np.int64)
    overflows = no_overflows()
    _trace(
        fmt.exp_bits,
        fmt.man_bits,
        one(fmt),
        margin_scale(fmt) if margin is None else margin,
        order.children,
        order.axis,
        bounds,
        corners,
        instances.leaves,
        instances.roots,
        instances.rows,
        len(bounds) - 1 if root is None else root,
        origins,
        directions,
        np.stack([t_min, t_max], axis=1),
        np.stack([order_key(fmt, t_min), order_key(fmt, t_max)], axis=1),
        hits,
        counts,
        overflows,
        stack_depth,
    )
    t, u, v, triangle, instance = hits.T
    counters: dict[str, int] = dict(zip(COUNTERS, counts.tolist(), strict=True))
    flags: dict[str, bool] = dict(zip(OVERFLOWS, overflows.tolist(), strict=True))
    return Hits(t, u, v, triangle, instance, counters, flags)


@njit(cache=True)
def _trace(
    exp_bits,
    man_bits,
    one,
    scale,
    children,
    axes,
    bounds,
    corners,
    instance_of,
    roots,
    matrices,
    root,
    origins,
    directions,
    limits,
    limit_keys,
    hits,
    counts,
    overflows,
    stack_depth,
):
    rows = np.empty((2, RAYS, COLUMNS), np.int64)  # of the world, and of an object
    seen_origin, seen_direction = np.empty(3, np.int64), np.empty(3, np.int64)
    sheared = np.empty((3, 3), np.int64)
    near, far = np.empty(RAYS, np.int64), np.empty(RAYS, np.int64)
    nears, fars = np.empty((2, RAYS), np.int64), np.empty((2, RAYS), np.int64)
    best = np.empty(RAYS, np.int64)  # key of t of the hit so far
    stack = np.empty(stack_depth, np.int64)
    stack_near = np.empty((stack_depth, RAYS), np.int64)
    stack_far = np.empty((stack_depth, RAYS), np.int64)
    stack_level = np.empty(stack_depth, np.int64)
    for packet in range(len(origins) // RAYS):
        base = packet * RAYS
        alive = False
        for ray in range(RAYS):
            setup_bits(
                exp_bits, man_bits, one, scale, origins[base + ray], directions[base + ray],
                rows[0, ray], overflows,
            )  # fmt: skip
            near[ray], far[ray] = limit_keys[base + ray]
            best[ray] = far[ray]
            hits[base + ray] = (limits[base + ray, 1], 0, 0, NO_TRIANGLE, NO_TRIANGLE)
            alive = alive or near[ray] <= far[ray]
        counts[0] += 1
        child, level, inside = root, 0, NO_TRIANGLE
        depth = 0
        while alive:
            if child >= 0:
                counts[1] += 1
                node, axis = child, axes[child]
                reached_left = reached_right = left_first = decided = False
                for ray in range(RAYS):
                    in_child = [False, False]
                    for side in range(2):
                        nears[side, ray], fars[side, ray] = clip_bits(
                            exp_bits,
                            man_bits,
                            rows[level, ray],
                            axis,
                            bounds[node, 2 * side],
                            bounds[node, 2 * side + 1],
                            near[ray],
                            far[ray],
                            overflows,
                        )
                        end = min(fars[side, ray], best[ray])
                        in_child[side] = nears[side, ray] <= end
                    reached_left = reached_left or in_child[0]
                    reached_right = reached_right or in_child[1]
                    if in_child[0] and in_child[1] and not decided:
                        decided = True
                        left_first = nears[0, ray] <= nears[1, ray]
                if reached_left or reached_right:
                    side = 0 if reached_left else 1
                    if reached_left and reached_right:
                        side = 0 if left_first or not decided else 1
                        stack[depth] = children[node, 1 - side]
                        stack_level[depth] = level
                        stack_near[depth] = nears[1 - side]
                        stack_far[depth] = fars[1 - side]
                        depth += 1
                        counts[4] += 1
                        counts[6] = max(counts[6], depth)
                    child = children[node, side]
                    near[:] = nears[side]
                    far[:] = fars[side]
                    continue
            elif instance_of[~child] >= 0 and level == 0:
                counts[2] += 1
                counts[7] += 1
                instance, inside = instance_of[~child], ~child
                alive = False
                for ray in range(RAYS):
                    transform_bits(
                        exp_bits, man_bits, matrices[instance], origins[base + ray],
                        directions[base + ray], seen_origin, seen_direction, overflows,
                    )  # fmt: skip
                    setup_bits(
                        exp_bits, man_bits, one, scale, seen_origin, seen_direction,
                        rows[1, ray], overflows,
                    )  # fmt: skip
                    near[ray], far[ray] = limit_keys[base + ray]
                    alive = alive or near[ray] <= min(far[ray], best[ray])
                child, level = roots[instance], 1
                if alive:
                    continue
            else:
                counts[2] += 1
                for ray in range(RAYS):
                    if near[ray] > min(far[ray], best[ray]):
                        continue
                    counts[3] += 1
                    hit, t, u, v = intersect_bits(
                        exp_bits, man_bits, rows[level, ray], corners[~child], sheared, overflows
                    )
                    key = key_bits(exp_bits, man_bits, t)
                    within = inside if level else NO_TRIANGLE
                    before = hits[base + ray, 4], hits[base + ray, 3]
                    if (
                        hit
                        and limit_keys[base + ray, 0] <= key
                        and (key < best[ray] or (key == best[ray] and (within, ~child) < before))
                    ):
                        best[ray] = key
                        hits[base + ray] = (t, u, v, ~child, within)
            alive = False
            while depth and not alive:
                depth -= 1
                counts[5] += 1
                for ray in range(RAYS):
                    near[ray], far[ray] = stack_near[depth, ray], stack_far[depth, ray]
                    alive = alive or near[ray] <= min(far[ray], best[ray])
                child, level = stack[depth], stack_level[depth]
