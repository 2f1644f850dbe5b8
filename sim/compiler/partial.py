"""Programs that update a part of a tree: the leaves that moved, and the nodes above them."""

from dataclasses import dataclass

import numba
import numpy as np

from hdl import records
from hdl.fp.format import FloatFormat
from hdl.isa import LAYOUTS, VERTEX_BITS, Opcode
from sim.compiler import fields
from sim.compiler.allocate import allocate
from sim.compiler.image import Image
from sim.compiler.order import Order, boxes_of, check_boxes
from sim.compiler.schedule import schedule
from sim.errors import InputError


@dataclass(frozen=True)
class Partial:
    """A program that updates a part of a tree, and what it needs in memory.

    A node bounds its children on one axis only, so the box of a subtree cannot be read back.
    The host knows it, and writes its lowest and its highest corner as two vertex records behind
    the image, from word `image.size` on.

    Attributes
    ----------
    instructions : (n,) uint32
        Empty if nothing moved.
    boxes : int
        Box registers that it needs.
    merged : (L,) bool
        Leaves that it merges: those that moved, and those beside what moved.
    spans : (K, 2) int32
        First leaf, and the one after the last, of each subtree whose box the host writes: record
        2k holds the lowest and record 2k + 1 the highest corner. The box has to be that of the
        vertices of which the bounds in this subtree were made.
    """

    instructions: np.ndarray
    boxes: int
    merged: np.ndarray
    spans: np.ndarray


def partial(image: Image, moved: np.ndarray) -> Partial:
    """The program of an update of the leaves that moved (L,), and of no other subtree.

    Nodes above what moved are merged, so no more than the levels of the tree for each leaf that
    moved. They are a smaller tree, of which each subtree beside them is a leaf with two corners;
    it is compiled as the whole one is. Made in time linear in the size of the tree.

    Raises
    ------
    InputError
        The boxes of what is beside it do not fit the memory, or have no vertex index; or the
        machine has too few box registers.
    """
    order, config = image.order, image.config
    moved = np.ascontiguousarray(moved, np.bool_)
    nodes, children, sources, spans = _reduce(order.children, moved)
    merged = np.zeros(len(moved), np.bool_)
    if not len(nodes):
        return Partial(np.zeros(0, np.uint32), 0, merged, spans)
    boxes = boxes_of(children)
    check_boxes(boxes, config)
    image.check_fits(image.size + 2 * len(spans))
    first = image.size - image.vertices_at  # vertex index of the first corner
    if first + 2 * len(spans) > 1 << VERTEX_BITS:
        raise InputError(
            f"boxes of a partial update lie at vertex {first} and on; an instruction addresses "
            f"{1 << VERTEX_BITS}: use a smaller scene"
        )
    leaf = sources >= 0
    merged[sources[leaf]] = True
    corners = np.empty((len(sources), 3), np.int32)
    corners[leaf] = image.corners[sources[leaf]]
    corners[~leaf] = first + 2 * ~sources[~leaf, None] + (0, 1, 1)

    loads = allocate(corners, config.vertex_registers, config.lead)
    reduced = Order(children, order.axis[nodes], np.zeros(0, np.int32), boxes)
    instructions = schedule(reduced, loads, loads.vertex, config)
    return Partial(_with_jumps(instructions, nodes), boxes, merged, spans)


def corner_words(fmt: FloatFormat, corners: np.ndarray) -> np.ndarray:
    """Vertex records (n, limbs) of bit patterns (n, 3): what the host writes behind the image."""
    words = np.zeros((len(corners), records.word_bits(fmt) // 32), np.uint32)
    for column, (_, field) in enumerate(records.vertex(fmt)):
        fields.put(words, field, corners[:, column])
    return words


def _with_jumps(instructions: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """A program whose merges write these nodes, ascending: with a NODE wherever some are left out.

    A jump stands right before its merge, which mostly has to wait there for the one before.
    """
    merges = np.flatnonzero(instructions & 3 == Opcode.MERGE2.value)
    jumps = np.diff(nodes, prepend=-1) != 1
    words = np.zeros((int(jumps.sum()), 1), np.uint32)
    fields.put(words, LAYOUTS[Opcode.NODE]["opcode"], np.full(len(words), Opcode.NODE.value))
    fields.put(words, LAYOUTS[Opcode.NODE]["node"], nodes[jumps])
    return np.insert(instructions, merges[jumps], words[:, 0])


@numba.njit(
    "Tuple((int32[::1], int32[:, ::1], int32[::1], int32[:, ::1]))(int32[:, ::1], boolean[::1])",
    cache=True,
)
def _reduce(children, moved):
    """The nodes above leaves that moved, as a tree of their own, in post-order.

    Returns the nodes; their children, as in an Order; the source of each leaf of this tree: a
    leaf, or ~k for subtree k; and the leaves of each subtree, from the first to after the last.
    A leaf comes after the subtrees of its node, so no more box registers are needed than before.
    """
    count = len(children)
    nodes = np.empty(count, np.int32)
    placed = np.empty((count, 2), np.int32)
    sources = np.empty(count + 1, np.int32)
    spans = np.empty((count, 2), np.int32)
    index = np.full(count, -1, np.int32)  # of a node in the new tree
    begin, end = np.empty(count, np.int32), np.empty(count, np.int32)  # leaves below
    kept = leaves = subtrees = 0
    for node in range(count):
        begin[node], end[node] = len(moved), 0
        moves = False
        for side in range(2):
            child = children[node, side]
            low, high = (begin[child], end[child]) if child >= 0 else (~child, ~child + 1)
            begin[node], end[node] = min(begin[node], low), max(end[node], high)
            moves = moves or (index[child] >= 0 if child >= 0 else moved[~child])
        if not moves:
            continue
        for side in range(2):
            child = children[node, side]
            if child >= 0 and index[child] >= 0:
                placed[kept, side] = index[child]
                continue
            placed[kept, side] = ~leaves
            sources[leaves] = ~child
            if child >= 0:
                spans[subtrees] = (begin[child], end[child])
                sources[leaves] = ~subtrees
                subtrees += 1
            leaves += 1
        nodes[kept] = node
        index[node] = kept
        kept += 1
    return (
        nodes[:kept].copy(),
        placed[:kept].copy(),
        sources[:leaves].copy(),
        spans[:subtrees].copy(),
    )
