"""Rays and trees for the traversal unit, and the way of each packet, step by step."""

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from hdl import records
from hdl.config import Config
from hdl.fp.format import FloatFormat
from sim.compiler.order import Order, order
from sim.model.fp.format import encode
from sim.model.fp.order import from_key, order_key
from sim.model.rays.overflow import no_overflows
from sim.model.rays.planes import clip_bits
from sim.model.rays.setup import (
    ABOVE,
    BELOW,
    COLUMNS,
    INVERSE_DOWN,
    INVERSE_UP,
    NEGATIVE,
    one,
    setup_bits,
)
from sim.model.rays.triangle import intersect_bits
from sim.model.refit import refit
from sim.tree.build import build
from tests.hdl.fp.operands import weighted

RAYS = 4
SLAB = {
    "above": ABOVE,
    "below": BELOW,
    "inverse_down": INVERSE_DOWN,
    "inverse_up": INVERSE_UP,
    "negative": NEGATIVE,
}
"""Columns of a row of sim.model.rays.setup that planes meet, on axis x; y and z follow."""


@dataclass(frozen=True)
class Scene:
    """A tree and rays, four a packet; all numbers are bit patterns.

    Attributes
    ----------
    bounds : (N, 4)
    corners : (L, 3, 3)
    origins, directions : (n, 3)
    limits : (n, 2), of t
    rows : (n, COLUMNS), of sim.model.rays.setup
    instances : dict
        Of leaves that are instances: a node at which packets go on, and the rows of their rays
        there. Below such a node there is no instance.
    """

    fmt: FloatFormat
    order: Order
    bounds: np.ndarray
    corners: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    limits: np.ndarray
    rows: np.ndarray
    instances: dict[int, tuple[int, np.ndarray]] = field(default_factory=dict)

    @property
    def packets(self) -> int:
        return len(self.rows) // RAYS

    def words(self) -> list[int]:
        """Node records."""
        layout = records.node(self.fmt)
        left = self.order.children[:, 0]
        links = {
            "axis": self.order.axis,
            "left_is_leaf": left < 0,
            "right_is_leaf": self.order.children[:, 1] < 0,
            "pointer": np.where(left < 0, ~left, left),
        }
        return [
            sum(int(value) << self.fmt.bits * k for k, value in enumerate(self.bounds[node]))
            | sum(int(column[node]) << layout[f].offset for f, column in links.items())
            for node in range(len(left))
        ]


class Visit(NamedTuple):
    """A packet at a child.

    child : a node, or ~ a triangle
    mask : rays that reach it
    best : t of the hit of each ray so far, after the visit
    pops : entries taken off the stack before it
    level : 1 in an object
    """

    child: int
    mask: int
    best: list[int]
    pops: int
    level: int


@dataclass
class Walk:
    """The way of a packet.

    Attributes
    ----------
    visits : list of Visit
    pushes, pops : int
    deepest : int
        Most entries on the stack.
    best : list of int
        Of each ray in the end.
    hits : list of int or None
        Triangle of each ray.
    """

    visits: list[Visit] = field(default_factory=list)
    pushes: int = 0
    pops: int = 0
    deepest: int = 0
    best: list[int] = field(default_factory=list)
    hits: list[int | None] = field(default_factory=list)


def walk(scene: Scene, packet: int) -> Walk:
    """What the docstring of sim.model.rays.traversal.trace says, in plain words."""
    fmt = scene.fmt
    form = fmt.exp_bits, fmt.man_bits
    rows = {0: scene.rows[RAYS * packet :][:RAYS]}
    limits = scene.limits[RAYS * packet :][:RAYS]
    keys = order_key(fmt, limits).tolist()
    best = [far for _, far in keys]
    way = Walk(hits=[None] * RAYS)

    def reach(intervals) -> list[bool]:
        return [near <= far and near <= best[k] for k, (near, far) in enumerate(intervals)]

    stack = [(len(scene.bounds) - 1, 0, keys)]
    nowhere = order_key(fmt, encode(fmt, [np.inf, -np.inf])).tolist()
    first, before = True, 0
    while stack:
        way.deepest = max(way.deepest, len(stack) - first)
        child, level, intervals = stack.pop()
        way.pops += not first
        first = False
        while any(reach(intervals)):
            inside = reach(intervals)
            enters = child < 0 and ~child in scene.instances
            if child < 0 and not enters:
                _test(scene, form, rows[level], keys, ~child, inside, best, way.hits)
            mask = sum(1 << k for k in range(RAYS) if inside[k])
            t = from_key(fmt, np.array(best)).tolist()
            way.visits.append(Visit(child, mask, t, way.pops - before, level))
            before = way.pops
            if enters:
                root, of_object = scene.instances[~child]
                rows[1] = of_object[RAYS * packet :][:RAYS]
                intervals = [keys[k] if inside[k] else nowhere for k in range(RAYS)]
                child, level = root, 1
                continue
            if child < 0:
                break
            sides = []
            for side in range(2):
                low, high = scene.bounds[child, 2 * side : 2 * side + 2].tolist()
                axis = int(scene.order.axis[child])
                sides.append([
                    clip_bits(*form, rows[level][k], axis, low, high, *intervals[k], no_overflows())
                    for k in range(RAYS)
                ])
            left, right = sides
            in_both = [k for k in range(RAYS) if reach(left)[k] and reach(right)[k]]
            swapped = bool(in_both) and left[in_both[0]][0] > right[in_both[0]][0]
            children = scene.order.children[child].tolist()
            entries = [(c, level, side) for c, side in zip(children, sides, strict=True)]
            entries = [e for e in entries[:: -1 if swapped else 1] if any(reach(e[2]))]
            if not entries:
                break
            if len(entries) == 2:
                stack.append(entries[1])
                way.pushes += 1
                way.deepest = max(way.deepest, len(stack))
            child, level, intervals = entries[0]
    way.best = from_key(fmt, np.array(best)).tolist()
    return way


def _test(scene, form, rows, keys, triangle, inside, best, hits):
    """Lower `best`, and set `hits`, of the rays that hit a triangle."""
    room = np.empty((3, 3), np.int64)
    for k in range(RAYS):
        if not inside[k]:
            continue
        hit, t, _, _ = intersect_bits(*form, rows[k], scene.corners[triangle], room, no_overflows())
        key = int(order_key(scene.fmt, t))
        nearer = key < best[k] or (key == best[k] and (hits[k] is None or triangle < hits[k]))
        if hit and keys[k][0] <= key and nearer:
            best[k], hits[k] = key, triangle


def setup_rows(fmt: FloatFormat, origins, directions, scale: int) -> np.ndarray:
    """Rows of sim.model.rays.setup for a margin of any scale."""
    rows = np.zeros((len(origins), COLUMNS), np.int64)
    for k, row in enumerate(rows):
        form = fmt.exp_bits, fmt.man_bits
        setup_bits(*form, one(fmt), scale, origins[k], directions[k], row, no_overflows())
    return rows


def mesh_scene(config: Config, rng, vertices, faces, packets: int, scale: int) -> Scene:
    """A mesh and rays towards it, some coherent, some not there, some that miss all."""
    fmt = config.fmt
    vertices = vertices - vertices.mean(axis=0)
    vertices = vertices / np.abs(vertices).max() * 0.99
    tree = order(build(vertices, faces), np.asarray(faces, np.int32), 64)
    corners = encode(fmt, vertices)[np.asarray(faces)[tree.triangles]]

    centre = rng.normal(size=(packets, 1, 3))
    spread = rng.choice([0.01, 0.3, 2.0], (packets, 1, 1))
    targets = 0.5 * centre / np.linalg.norm(centre, axis=2, keepdims=True)
    targets = (targets + spread * rng.normal(size=(packets, RAYS, 3))).reshape(-1, 3)
    origins = rng.normal(size=(packets, 1, 3)) * rng.choice([0.1, 1.0, 1.5], (packets, 1, 1))
    origins = np.repeat(origins, RAYS, axis=1).reshape(-1, 3)
    directions = targets - origins
    directions[rng.random(len(directions)) < 0.1] *= -1
    parallel = rng.random(directions.shape) < 0.1
    directions[parallel] = rng.choice([0.0, -0.0], parallel.sum())

    t_min = np.where(rng.random(len(origins)) < 0.7, 0.0, rng.random(len(origins)))
    t_max = np.where(rng.random(len(origins)) < 0.7, np.inf, 2 * rng.random(len(origins)))
    dead = rng.random((packets, RAYS)) < rng.choice(
        [0.0, 0.5, 1.0], (packets, 1), p=[0.7, 0.2, 0.1]
    )
    t_max[dead.ravel()] = -1.0
    origins, directions, limits = (
        encode(fmt, x) for x in (origins, directions, np.stack([t_min, t_max], axis=1))
    )
    rows = setup_rows(fmt, origins, directions, scale)
    return Scene(fmt, tree, refit(fmt, tree, corners), corners, origins, directions, limits, rows)


def any_scene(config: Config, rng, tree: Order, packets: int) -> Scene:
    """A tree whose bounds, triangles and rays are any numbers."""
    fmt = config.fmt
    nodes, rays = len(tree.axis), RAYS * packets
    bounds = weighted(fmt, rng, nodes, 4)
    corners = weighted(fmt, rng, 3 * len(tree.triangles), 3).reshape(-1, 3, 3)
    origins, directions = weighted(fmt, rng, rays, 3), weighted(fmt, rng, rays, 3)
    limits = weighted(fmt, rng, rays, 2)
    infinity = ((1 << fmt.exp_bits) - 1) << fmt.man_bits
    limits[rng.random(rays) < 0.6] = (0, infinity)
    scale = int(weighted(fmt, rng, 1, 1)[0, 0]) & ((1 << (fmt.bits - 1)) - 1)
    rows = setup_rows(fmt, origins, directions, scale)
    return Scene(fmt, tree, bounds, corners, origins, directions, limits, rows)


def with_instances(scene: Scene, rng) -> Scene:
    """A scene some of whose leaves stand for a part of its own tree, seen by other rays."""
    children, fmt = scene.order.children, scene.fmt
    leaves = np.flatnonzero(rng.random(len(scene.corners)) < 0.3)
    free = np.zeros(len(children), bool)  # nodes with no such leaf below
    for node, pair in enumerate(children.tolist()):
        free[node] = all(free[c] if c >= 0 else ~c not in leaves for c in pair)
    roots = np.flatnonzero(free)
    if not len(roots):
        return scene
    instances = {}
    for leaf in leaves.tolist():
        shift = rng.permutation(3)
        origins, directions = (x[:, shift] for x in (scene.origins, scene.directions))
        rows = setup_rows(fmt, origins, directions, 0)
        instances[leaf] = int(rng.choice(roots)), rows
    return replace(scene, instances=instances)
