"""The order of nodes and leaves in memory: post-order, and how many boxes that keeps alive."""

from dataclasses import dataclass

import numba
import numpy as np

from hdl.config import Config
from sim.compiler.sequence import sequence
from sim.errors import UnfitError
from sim.tree.tree import Tree


@dataclass(frozen=True)
class Order:
    """A tree in the order of its records.

    Nodes are in post-order: those of the left subtree, those of the right one, the node. So an
    inner right child is the node before. A node with one leaf has it on the left; two leaves of
    one node follow each other.

    Attributes
    ----------
    children : (N, 2) int32
        Left and right child: a node in this order if >= 0, else ~child is a leaf.
    axis : (N,) uint8
    triangles : (N + 1,) int32
        The triangle of each leaf.
    boxes : int
        Box registers that the nodes need when no leaf is merged before its turn.
    """

    children: np.ndarray
    axis: np.ndarray
    triangles: np.ndarray
    boxes: int


def order(tree: Tree, faces: np.ndarray, box_registers: int) -> Order:
    """Post-order in linear time, with the children in the order that shares most vertices.

    Where half of the box registers do not hold that, the child that needs more comes first: no
    post-order needs fewer (Sethi, Ullman 1970), at most log2 of the number of leaves, plus 1.

    Parameters
    ----------
    tree : Tree
    faces : (T, 3) int32
    box_registers : int

    Raises
    ------
    InputError
        The tree needs more than `box_registers`; names the smallest subtree that does.
    """
    children = np.ascontiguousarray(tree.children, np.int32)
    need, leaves = _needs(children)
    if need[0] > box_registers:
        beyond = np.flatnonzero(need > box_registers)
        node = int(beyond[leaves[beyond].argmin()])
        raise UnfitError(
            f"the subtree of node {node} ({leaves[node]} triangles) needs {need[node]} box "
            f"registers: box_registers is {box_registers} and has to be {need[0]}"
        )
    spare = max(int(need[0]), box_registers // 2)  # the rest is for leaves that are hoisted
    right_first, boxes = sequence(children, faces, need, leaves, spare)
    placed, axis, triangles = _place(children, np.asarray(tree.axis, np.uint8), right_first)
    return Order(placed, axis, triangles, boxes)


def least_boxes(tree: Tree) -> int:
    """Box registers that a tree needs in any order."""
    return int(_needs(np.ascontiguousarray(tree.children, np.int32))[0][0])


@numba.njit("int64(int32[:, ::1])", cache=True)
def boxes_of(children):
    """Box registers that nodes in post-order need; a leaf beside a node comes after it."""
    boxes = np.empty(len(children), np.int64)
    for node in range(len(children)):
        left, right = children[node, 0], children[node, 1]
        if left >= 0 and right >= 0:
            boxes[node] = max(boxes[left], 1 + boxes[right])
        else:
            boxes[node] = max(boxes[max(left, right)], 2) if max(left, right) >= 0 else 2
    return boxes.max()


def check_boxes(boxes: int, config: Config):
    """Refuse an order that needs more box registers than the machine has."""
    if boxes > config.box_registers:
        raise UnfitError(
            f"what moves needs {boxes} box registers: box_registers is {config.box_registers} and "
            f"has to be {boxes}"
        )


@numba.njit("Tuple((int32[::1], int32[::1]))(int32[:, ::1])", cache=True)
def _needs(children):
    """Box registers and leaves of the subtree of each node."""
    count = len(children)
    need = np.empty(count, np.int32)
    leaves = np.zeros(count, np.int32)
    for node in range(count - 1, -1, -1):
        needs = np.ones(2, np.int32)
        for side in range(2):
            child = children[node, side]
            if child >= 0:
                needs[side] = need[child]
                leaves[node] += leaves[child]
            else:
                leaves[node] += 1
        need[node] = max(needs.max(), needs.min() + 1)
    return need, leaves


@numba.njit(cache=True)
def _sides(children, right_first, node):
    """Left and right child of the record: as they follow each other, but a leaf before a node."""
    left, right = children[node, 0], children[node, 1]
    if right_first[node]:
        left, right = right, left
    if right < 0 <= left:
        return right, left
    return left, right


@numba.njit(
    "Tuple((int32[:, ::1], uint8[::1], int32[::1]))(int32[:, ::1], uint8[::1], boolean[::1])",
    cache=True,
)
def _place(children, axis, right_first):
    """Children and axis of each node in the new order, and the triangle of each leaf."""
    count = len(children)
    placed = np.empty((count, 2), np.int32)
    placed_axis = np.empty(count, np.uint8)
    triangles = np.empty(count + 1, np.int32)
    index = np.empty(count, np.int32)  # of a node in the new order
    nodes = 0
    leaves = 0
    stack = np.empty(count + 1, np.int32)  # nodes on the way down, ~node on the way up
    stack[0] = 0
    depth = 1
    while depth:
        depth -= 1
        node = stack[depth]
        if node >= 0:
            stack[depth] = ~node
            depth += 1
            first, second = _sides(children, right_first, node)
            for child in (second, first):  # the one on top of the stack comes first
                if child >= 0:
                    stack[depth] = child
                    depth += 1
        else:
            node = ~node
            for side, child in enumerate(_sides(children, right_first, node)):
                if child >= 0:
                    placed[nodes, side] = index[child]
                else:
                    placed[nodes, side] = ~leaves
                    triangles[leaves] = ~child
                    leaves += 1
            placed_axis[nodes] = axis[node]
            index[node] = nodes
            nodes += 1
    return placed, placed_axis, triangles
