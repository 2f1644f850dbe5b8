"""Packets of four rays on their way through a tree: the loop of sim.model.rays.traversal."""

import numpy as np
from numba import njit

from hdl.rays.packet import NO_TRIANGLE, RAYS
from sim.model.rays.planes import key_bits
from sim.model.rays.setup import COLUMNS, setup_bits
from sim.model.rays.step import step_bits
from sim.model.rays.transform import transform_bits
from sim.model.rays.triangle import intersect_bits


@njit(cache=True)
def trace_bits(
    exp_bits,
    man_bits,
    one,
    scale,
    children,
    axes,
    bounds,
    corners,
    instance_of,
    matrices,
    roots,
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
    """Fill hits (n, 5): t, u, v, triangle and instance of each ray. Add to counts, set overflows.

    What sim.model.rays.traversal.trace says, on arrays alone.
    """
    rows = np.empty((2, RAYS, COLUMNS), np.int64)  # in the world, and in an object
    sheared = np.empty((3, 3), np.int64)
    origin, direction = np.empty(3, np.int64), np.empty(3, np.int64)
    near, far = np.empty(RAYS, np.int64), np.empty(RAYS, np.int64)
    nears, fars = np.empty((2, RAYS), np.int64), np.empty((2, RAYS), np.int64)
    best = np.empty(RAYS, np.int64)  # key of t of the hit so far
    stack, stack_level = np.empty(stack_depth, np.int64), np.empty(stack_depth, np.int64)
    stack_near = np.empty((stack_depth, RAYS), np.int64)
    stack_far = np.empty((stack_depth, RAYS), np.int64)
    infinity = ((1 << exp_bits) - 1) << man_bits
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
                reached_left, reached_right, side = step_bits(
                    exp_bits, man_bits, rows[level], axes[child], bounds[child], near, far, best,
                    nears, fars, overflows,
                )  # fmt: skip
                if reached_left or reached_right:
                    if reached_left and reached_right:
                        stack[depth], stack_level[depth] = children[child, 1 - side], level
                        stack_near[depth] = nears[1 - side]
                        stack_far[depth] = fars[1 - side]
                        depth += 1
                        counts[4] += 1
                        counts[6] = max(counts[6], depth)
                    child = children[child, side]
                    near[:] = nears[side]
                    far[:] = fars[side]
                    continue
            elif instance_of[~child] >= 0:
                counts[2] += 1
                counts[7] += 1
                instance = instance_of[~child]
                for ray in range(RAYS):
                    transform_bits(
                        exp_bits, man_bits, matrices[instance], origins[base + ray],
                        directions[base + ray], origin, direction, overflows,
                    )  # fmt: skip
                    setup_bits(
                        exp_bits, man_bits, one, scale, origin, direction, rows[1, ray], overflows
                    )
                    if near[ray] <= min(far[ray], best[ray]):
                        near[ray], far[ray] = limit_keys[base + ray]
                    else:  # it does not enter
                        near[ray], far[ray] = infinity, ~infinity
                child, level, inside = roots[instance], 1, ~child
                continue
            else:
                counts[2] += 1
                triangle, of = ~child, inside if level else NO_TRIANGLE
                for ray in range(RAYS):
                    if near[ray] > min(far[ray], best[ray]):
                        continue
                    counts[3] += 1
                    hit, t, u, v = intersect_bits(
                        exp_bits, man_bits, rows[level, ray], corners[triangle], sheared, overflows
                    )
                    key, old = key_bits(exp_bits, man_bits, t), hits[base + ray]
                    lower = of < old[4] or (of == old[4] and triangle < old[3])
                    if (
                        hit
                        and limit_keys[base + ray, 0] <= key
                        and (key < best[ray] or (key == best[ray] and lower))
                    ):
                        best[ray] = key
                        hits[base + ray] = (t, u, v, triangle, of)
            alive = False
            while depth and not alive:
                depth -= 1
                counts[5] += 1
                for ray in range(RAYS):
                    near[ray], far[ray] = stack_near[depth, ray], stack_far[depth, ray]
                    alive = alive or near[ray] <= min(far[ray], best[ray])
                child, level = stack[depth], stack_level[depth]
