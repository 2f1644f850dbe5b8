"""The memory image of a scene: where each record lies, and the words that hold it."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hdl import records
from hdl.config import Config
from sim.compiler import fields
from sim.compiler.order import Order
from sim.compiler.written import written_nodes
from sim.errors import UnfitError


def no_rows(*shape: int) -> np.ndarray:
    return np.zeros((0, *shape), np.int32)


@dataclass(frozen=True)
class Instances:
    """Leaves that are instances of objects, and the trees of these.

    Attributes
    ----------
    leaves : (I,) int32
        The leaf of each instance.
    roots : (I,) int32
        The root of its object's tree.
    spans : (I, 2) int32
        The first leaf of that tree, and the one after its last.
    """

    leaves: np.ndarray = field(default_factory=no_rows)
    roots: np.ndarray = field(default_factory=no_rows)
    spans: np.ndarray = field(default_factory=lambda: no_rows(2))

    def __len__(self) -> int:
        return len(self.leaves)


@dataclass(frozen=True)
class Image:
    """A compiled scene, in memory words of (limbs,) uint32, the lowest limb first.

    The program lies at word 0; vertices, rows of instances, triangles, nodes and corners of still
    boxes follow. Vertices, rows and bounds change with every frame, the rest is constant. For a
    machine that does not update trees there is no program; bounds are written with the vertices.

    Attributes
    ----------
    config : Config
    order : Order
        Of the nodes, and of the leaves and so the triangle records.
    instructions : (n,) uint32
    vertices : (V,) int32
        The scene's vertex in each vertex record, in the order in which triangles use them.
    corners : (T, 3) int32
        Vertex records that each leaf is merged from: of a triangle its corners, of an instance the
        lowest and the highest corner of its box.
    world : int
        Nodes of the tree that rays enter: the first ones. Those of objects follow.
    instances : Instances
    still : (K, 2) int32
        Subtrees that the program leaves out, from their first leaf to after their last: the lowest
        and the highest corner of each box are vertex records behind the nodes.
    room : int
        Instructions that there is place for, if they are more: for programs of other trees.
    """

    config: Config
    order: Order
    instructions: np.ndarray
    vertices: np.ndarray
    corners: np.ndarray
    world: int
    instances: Instances = Instances()
    still: np.ndarray = field(default_factory=lambda: no_rows(2))
    room: int = 0

    def __post_init__(self):
        self.check_fits(self.size)

    def check_fits(self, words: int):
        """Refuse what takes more memory words than the configuration addresses."""
        limit = 1 << self.config.address_bits
        if words > limit:
            raise UnfitError(
                f"it takes {words} memory words and the machine addresses {limit}: "
                f"address_bits is {self.config.address_bits} and has to be "
                f"{(words - 1).bit_length()}"
            )

    @property
    def limbs(self) -> int:
        return records.word_bits(self.config.fmt) // 32

    @property
    def nodes(self) -> int:
        return len(self.order.axis)

    @property
    def vertices_at(self) -> int:
        return -(-max(len(self.instructions), self.room) // self.limbs)

    @property
    def rows_at(self) -> int:
        return self.vertices_at + len(self.vertices)

    @property
    def triangles_at(self) -> int:
        return self.rows_at + 3 * len(self.instances)

    @property
    def nodes_at(self) -> int:
        return self.triangles_at + len(self.corners)

    @property
    def still_at(self) -> int:
        return self.nodes_at + self.nodes

    @property
    def records(self) -> int:
        """Vertex records that a program may load: all words from the first vertex on."""
        return self.size - self.vertices_at

    @property
    def size(self) -> int:
        """Words in all."""
        return self.still_at + 2 * len(self.still)

    @property
    def regions(self) -> dict[str, range]:
        """Words of each kind of record, by name, in the order in which they lie."""
        starts = {
            "program": 0,
            "vertex": self.vertices_at,
            "row": self.rows_at,
            "triangle": self.triangles_at,
            "node": self.nodes_at,
            "corner": self.still_at,
        }
        ends = [*starts.values(), self.size][1:]
        return {name: range(*at) for name, *at in zip(starts, starts.values(), ends, strict=True)}

    @cached_property
    def updated(self) -> np.ndarray:
        """Nodes (N,) of which the program writes the bounds."""
        updated = np.zeros(self.nodes, np.bool_)
        updated[written_nodes(self.instructions)] = True
        return updated

    def constant_words(self) -> np.ndarray:
        """The whole image, with all coordinates and bounds zero."""
        words = np.zeros((self.size, self.limbs), np.uint32)
        words[: self.vertices_at].reshape(-1)[: len(self.instructions)] = self.instructions
        words[self.triangles_at : self.nodes_at] = self._triangles()
        words[self.nodes_at : self.still_at] = self._links()
        return words

    def vertex_words(self, coordinates: np.ndarray) -> np.ndarray:
        """Vertex records (V, limbs) of the bit patterns (scene's vertices, 3) of a frame."""
        words = np.zeros((len(self.vertices), self.limbs), np.uint32)
        layout = records.vertex(self.config.fmt)
        for column, name in enumerate("xyz"):
            fields.put(words, layout[name], coordinates[self.vertices, column])
        return words

    def row_words(self, rows: np.ndarray) -> np.ndarray:
        """Records (3I, limbs) of the bit patterns (I, 3, 4) of the instances' rows."""
        words = np.zeros((3 * len(rows), self.limbs), np.uint32)
        layout = records.row(self.config.fmt)
        for column, name in enumerate(("x", "y", "z", "offset")):
            fields.put(words, layout[name], rows[:, :, column].ravel())
        fields.put(words, layout["root"], np.repeat(self.instances.roots, 3))
        return words

    def node_words(self, bounds: np.ndarray) -> np.ndarray:
        """Node records (N, limbs) with the bit patterns (N, 4) of their bounds."""
        words = self._links()
        layout = records.bounds(self.config.fmt)
        for column, (_, of) in enumerate(layout):
            fields.put(words, of, bounds[:, column])
        return words

    def bounds_of(self, words: np.ndarray) -> np.ndarray:
        """Bit patterns (n, 4) of the bounds in node records: the inverse of `node_words`."""
        layout = records.bounds(self.config.fmt)
        return np.stack([fields.get(words, of) for _, of in layout], axis=1)

    def _triangles(self) -> np.ndarray:
        instances, corners = self.instances, self.corners.copy()
        first = len(self.vertices) + 3 * np.arange(len(instances))
        corners[instances.leaves] = first[:, None] + (0, 1, 2)
        words = np.zeros((len(corners), self.limbs), np.uint32)
        for column, name in enumerate(("v0", "v1", "v2")):
            fields.put(words, records.TRIANGLE[name], corners[:, column])
        is_instance = np.zeros(len(corners), np.int64)
        is_instance[instances.leaves] = 1
        fields.put(words, records.TRIANGLE["is_instance"], is_instance)
        return words

    def _links(self) -> np.ndarray:
        left, right = self.order.children.T
        words = np.zeros((self.nodes, self.limbs), np.uint32)
        layout = records.node(self.config.fmt)
        fields.put(words, layout["axis"], self.order.axis)
        fields.put(words, layout["left_is_leaf"], left < 0)
        fields.put(words, layout["right_is_leaf"], right < 0)
        fields.put(words, layout["pointer"], np.where(left < 0, ~left, left))
        return words
