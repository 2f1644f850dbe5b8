"""Scenes of two levels: a world of triangles and of instances of objects."""

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from hdl import records
from hdl.config import Config
from hdl.fp.format import FloatFormat
from hdl.rays.packet import MARGIN_ULPS, instance_margin
from sim.compiler import fields
from sim.compiler.order import Order, order
from sim.model.fp.format import decode, encode
from sim.model.rays.transform import Instances
from sim.model.refit import refit
from sim.tree.build import build
from tests.sim.tree.meshes import soup

WELL, ANY = "well", "any"
"""Kinds of matrices: such as a compiler lets through; and besides those singular and infinite ones,
with boxes of any size around them."""


@dataclass(frozen=True)
class Forest:
    """Trees of objects, then that of the world; all numbers are bit patterns.

    Attributes
    ----------
    order : Order
        Of all nodes and all leaves.
    bounds : (N, 4)
    corners : (L, 3, 3)
        Of a leaf that is an instance two corners of its box, one of them twice.
    instances : Instances
    margin : int
    """

    fmt: FloatFormat
    order: Order
    bounds: np.ndarray
    corners: np.ndarray
    instances: Instances
    margin: int

    def leaves(self) -> dict[int, range]:
        """Leaves of each object's tree, by its root; those of the world by -1."""
        found, first = {}, 0
        for root in sorted(set(self.instances.roots.tolist())):
            last = root + 2 + len(found)  # each tree has a leaf more than nodes
            found[root], first = range(first, last), last
        return found | {-1: range(first, len(self.corners))}

    def points(self, rng, count: int) -> np.ndarray:
        """Corners of triangles and what lies between them, in the world, (count, 3) float64."""
        of, leaves, found = self.instances, self.leaves(), []
        for leaf in rng.choice(leaves[-1], count):
            k, to_world = of.of_leaf[leaf], np.eye(3, 4)
            if k >= 0:
                leaf = rng.choice(leaves[of.roots[k]])
                with suppress(np.linalg.LinAlgError):
                    to_world = _inverse(decode(self.fmt, of.rows[k]))
            weights = rng.dirichlet([1.0] * 3) if rng.random() < 0.5 else np.eye(3)[0]
            found.append(to_world @ [*(weights @ decode(self.fmt, self.corners[leaf])), 1.0])
        return np.nan_to_num(found, posinf=0.0, neginf=0.0).clip(-2, 2)

    def words(self, config: Config) -> tuple[np.ndarray, dict]:
        """Memory words (n, limbs) from address 0 on, and the scene's fields of a job."""
        fmt, of = self.fmt, self.instances.of_leaf
        leaves, limbs = len(of), records.word_bits(fmt) // 32
        points, rows, triangles, nodes = (
            np.zeros((count, limbs), np.uint32)
            for count in (3 * leaves, 3 * len(self.instances.roots), leaves, len(self.bounds))
        )
        for k, (_, field) in enumerate(records.vertex(fmt)):
            fields.put(points, field, self.corners.reshape(-1, 3)[:, k])
        row = records.row(fmt)
        for k, name in enumerate(("x", "y", "z", "offset")):
            fields.put(rows, row[name], self.instances.rows[:, :, k].ravel())
        fields.put(rows[::3], row["root"], self.instances.roots)
        for k, name in enumerate(("v0", "v1", "v2")):
            index = np.where(of < 0, 3 * np.arange(leaves), 3 * leaves + 3 * of) + k
            fields.put(triangles, records.TRIANGLE[name], index)
        fields.put(triangles, records.TRIANGLE["is_instance"], of >= 0)
        node, left = records.node(fmt), self.order.children[:, 0]
        for k, (_, field) in enumerate(records.bounds(fmt)):
            fields.put(nodes, field, self.bounds[:, k])
        fields.put(nodes, node["axis"], self.order.axis)
        fields.put(nodes, node["left_is_leaf"], left < 0)
        fields.put(nodes, node["right_is_leaf"], self.order.children[:, 1] < 0)
        fields.put(nodes, node["pointer"], np.where(left < 0, ~left, left))
        vertices = len(points) + len(rows)
        place = {
            "vertices": 0,
            "triangles": vertices,
            "nodes": vertices + leaves,
            "root": len(nodes) - 1,
            "margin": fmt.layout.from_bits(self.margin),
        }
        return np.concatenate([points, rows, triangles, nodes]), place


def forest(fmt: FloatFormat, rng, *, matrices: str = WELL, size: int = 12) -> Forest:
    """Some objects, more instances of them, two of one place, and triangles of the world."""
    objects = [_object(rng, int(count)) for count in rng.integers(1, size, 3)]
    parts = [_tree(vertices, faces) for vertices, faces in objects]
    roots = np.cumsum([len(part.axis) for part in parts]) - 1
    kinds = np.append(np.arange(3), rng.integers(0, 3, 5))
    placed = [_place(rng) for _ in kinds]
    placed[-1], kinds[-1] = placed[3], kinds[3]  # the same twice
    rows = np.stack([encode(fmt, _inverse(place)) for place in placed])
    boxes = [
        _box(fmt, _inverse(decode(fmt, of)), objects[k][0])
        for of, k in zip(rows, kinds, strict=True)
    ]
    if matrices == ANY:
        rows[1, 2] = rows[1, 1]  # flat
        rows[2] = encode(fmt, rng.normal(size=(3, 4)) * 2.0 ** rng.integers(-9, 9, (3, 4)))
        rows[4, rng.integers(3), rng.integers(4)] = encode(fmt, np.inf)
        rows[5, :, :3] = encode(fmt, -0.0)
        rows[6, 0] = encode(fmt, 1.9 * 2.0**fmt.max_exp)

    # Leaves of the world: instances and triangles, in the order that a tree over boxes gives them.
    triangles = rng.uniform(-1, 1, (6, 1, 3)) + rng.uniform(-0.3, 0.3, (6, 3, 3))
    triangles = encode(fmt, np.clip(triangles, -1, 1))
    world = np.concatenate([np.array([[lo, hi, hi] for lo, hi in boxes]), triangles])
    count = len(world)
    top = _tree(decode(fmt, world).reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    of = np.append(np.arange(len(kinds)), np.full(len(triangles), -1))
    corners = [
        encode(fmt, vertices)[np.asarray(faces)[part.triangles]]
        for (vertices, faces), part in zip(objects, parts, strict=True)
    ]
    of_leaf = [np.full(len(part.triangles), -1, np.int64) for part in parts]
    whole = _joined([*parts, top])
    corners = np.concatenate([*corners, world[top.triangles]])
    instances = Instances(np.concatenate([*of_leaf, of[top.triangles]]), rows, roots[kinds])
    need = max(_margin(fmt, decode(fmt, of)) for of in rows) if matrices == WELL else 0.0
    need = max(need, MARGIN_ULPS * 2.0 ** -(fmt.man_bits + 1))
    margin = int(encode(fmt, need * (1 + 2.0**-fmt.man_bits)))
    return Forest(fmt, whole, refit(fmt, whole, corners), corners, instances, margin)


def rays_at(fmt: FloatFormat, forest: Forest, rng, packets: int) -> tuple[np.ndarray, ...]:
    """Packets towards leaves of the world, coherent or not; some rays are not there."""
    aims = np.repeat(forest.points(rng, packets), 4, axis=0)
    spread = np.repeat(rng.choice([0.0, 0.01, 0.1], (packets, 1)), 4, axis=0)
    spread *= rng.random((len(aims), 1)) < 0.8
    origins = np.repeat(rng.normal(size=(packets, 3)), 4, axis=0)
    directions = aims + spread * rng.normal(size=aims.shape) - origins
    directions[rng.random(directions.shape) < 0.05] = rng.choice([0.0, -0.0])
    t_min, t_max = np.zeros(len(aims)), np.full(len(aims), np.inf)
    some, gone = rng.random((2, len(aims))) < 0.1
    t_min[some], t_max[some] = 0.7, 1.1
    gone[:4] = True  # a whole packet
    t_min[gone], t_max[gone] = np.inf, -np.inf
    return tuple(encode(fmt, x) for x in (origins, directions, t_min, t_max))


def _object(rng, triangles: int) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = soup(rng, triangles, 0.5)
    vertices -= vertices.mean(axis=0)
    return vertices / np.abs(vertices).max() * 0.99, faces


def _tree(vertices: np.ndarray, faces: np.ndarray) -> Order:
    return order(build(vertices, faces), np.asarray(faces, np.int32), 64)


def _joined(trees: list[Order]) -> Order:
    """Trees one after the other, as one order."""
    nodes = leaves = 0
    children = []
    for tree in trees:
        children.append(np.where(tree.children < 0, tree.children - leaves, tree.children + nodes))
        nodes, leaves = nodes + len(tree.axis), leaves + len(tree.triangles)
    return Order(
        np.concatenate(children).astype(np.int32),
        np.concatenate([tree.axis for tree in trees]),
        np.concatenate([tree.triangles for tree in trees]),
        max(tree.boxes for tree in trees),
    )


def _place(rng) -> np.ndarray:
    """A map (3, 4) from an object to the world: turned, scaled, mirrored or sheared."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    scale = rng.uniform(0.1, 0.22) * rng.choice([-1, 1], 3) * rng.choice([1.0, 0.5], 3)
    shear = np.eye(3) + np.triu(rng.choice([0.0, 0.4], (3, 3)), 1)
    return np.column_stack([turn @ np.diag(scale) @ shear, rng.uniform(-0.4, 0.4, 3)])


def _inverse(place: np.ndarray) -> np.ndarray:
    inverse = np.linalg.inv(place[:, :3])
    return np.column_stack([inverse, -inverse @ place[:, 3]])


def _box(fmt: FloatFormat, to_world: np.ndarray, vertices: np.ndarray) -> tuple:
    """Corners of a box around an object's vertices as they are rounded, rounded outward."""
    points = decode(fmt, encode(fmt, vertices)) @ to_world[:, :3].T + to_world[:, 3]
    ulp = 2.0**-fmt.man_bits
    return encode(fmt, points.min(axis=0) - ulp), encode(fmt, points.max(axis=0) + ulp)


def _margin(fmt: FloatFormat, rows: np.ndarray) -> float:
    norm, inverse = (np.abs(x).sum(axis=1).max() for x in (rows[:, :3], np.linalg.inv(rows[:, :3])))
    return instance_margin(fmt, float(norm), float(inverse))
