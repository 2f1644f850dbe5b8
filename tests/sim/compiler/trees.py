"""Trees and meshes to compile, and what a tree is when it is taken apart by hand."""

import numpy as np
from hypothesis import strategies as st

from sim.compiler.order import Order
from sim.tree.tree import Tree


def grown(picks: list[int], triangles: np.ndarray, axis: np.ndarray) -> Tree:
    """A tree in which each node takes one of the places still open, parents before children."""
    if len(triangles) == 1:
        return Tree(np.full((1, 2), ~0, np.int32), np.asarray(axis[:1], np.uint8))
    children = np.empty((len(triangles) - 1, 2), np.int32)
    places = [(0, 0), (0, 1)]
    for node, pick in enumerate(picks, start=1):
        children[places.pop(pick % len(places))] = node
        places += [(node, 0), (node, 1)]
    for place, triangle in zip(places, triangles, strict=True):
        children[place] = ~triangle
    return Tree(children, np.asarray(axis, np.uint8))


def random_tree(rng: np.random.Generator, triangles: int) -> Tree:
    """Any shape, nodes and triangles in any order, any axes."""
    return grown(
        rng.integers(0, 1 << 30, max(triangles - 2, 0)).tolist(),
        rng.permutation(triangles),
        rng.integers(0, 3, max(triangles - 1, 1)),
    )


def chain(triangles: int, leaf_left: bool) -> Tree:
    """Every node has a leaf; the deepest two."""
    nodes = triangles - 1
    inner = np.append(np.arange(1, nodes), ~nodes).astype(np.int32)
    sides = [~np.arange(nodes, dtype=np.int32), inner]
    children = np.stack(sides if leaf_left else sides[::-1], axis=1)
    return Tree(np.ascontiguousarray(children), np.arange(nodes, dtype=np.uint8) % 3)


def balanced(levels: int) -> Tree:
    """2**levels triangles, all as deep; nodes in the order of their levels."""
    nodes = (1 << levels) - 1
    children = np.arange(1, 2 * nodes + 1).reshape(nodes, 2)
    children = np.where(children < nodes, children, ~(children - nodes))
    return Tree(children.astype(np.int32), np.arange(nodes, dtype=np.uint8) % 3)


@st.composite
def trees(draw, most: int, least: int = 1):
    """Random trees; Hypothesis shrinks them to small and one-sided ones."""
    count = draw(st.integers(least, most))
    inner, nodes = max(count - 2, 0), max(count - 1, 1)
    return grown(
        draw(st.lists(st.integers(0, most), min_size=inner, max_size=inner)),
        np.array(draw(st.permutations(range(count)))),
        np.array(draw(st.lists(st.integers(0, 2), min_size=nodes, max_size=nodes))),
    )


def leaves_below(children: np.ndarray, child: int) -> list[int]:
    """Leaves below a child of a tree or of an order, left to right; no recursion."""
    found, open_ = [], [child]
    while open_:
        child = open_.pop()
        if child < 0:
            found.append(~child)
        else:
            open_ += children[child][::-1].tolist()
    return found


def shape(tree: Tree, child: int = 0) -> tuple:
    """A tree as nested (axis, set of two children), so that left and right do not matter."""
    if child < 0:
        return ("leaf", ~child)
    sides = sorted(shape(tree, c) for c in tree.children[child].tolist())
    return ("node", int(tree.axis[child]), *sides)


def order_shape(order: Order, child: int) -> tuple:
    """The same of an order, by the triangles of its leaves."""
    if child < 0:
        return ("leaf", int(order.triangles[~child]))
    sides = sorted(order_shape(order, c) for c in order.children[child].tolist())
    return ("node", int(order.axis[child]), *sides)


def needs(tree: Tree | Order) -> list[int]:
    """Box registers for the subtree of each node, child after child, the better one first."""
    need = {}
    nodes = range(len(tree.axis))  # an order has children first
    for node in nodes if isinstance(tree, Order) else reversed(nodes):
        a, b = (need[c] if c >= 0 else 1 for c in tree.children[node].tolist())
        need[node] = min(max(a, b + 1), max(b, a + 1))
    return [need[node] for node in range(len(need))]


def icosphere(cuts: int):
    """A closed mesh (vertices, faces) of 20 * 4**cuts triangles, two for each vertex."""
    golden = (1 + 5**0.5) / 2
    short = np.array([(0, a, b) for a in (-1, 1) for b in (-golden, golden)])
    vertices = np.concatenate([np.roll(short, k, axis=1) for k in range(3)])
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 2.1
    faces = np.array([
        (a, b, c)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if near[a, b] and near[b, c] and near[a, c]
    ])
    for _ in range(cuts):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        edges, index = np.unique(edges, axis=0, return_inverse=True)
        a, b, c = faces.T
        ab, bc, ca = index.reshape(-1, 3).T + len(vertices)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        faces = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]).transpose(0, 2, 1)
        faces = faces.reshape(-1, 3)
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    return vertices, faces.astype(np.int32)
