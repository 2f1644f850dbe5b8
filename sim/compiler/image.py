"""The memory image of a scene: where each record lies, and the words that hold it."""

from dataclasses import dataclass

import numpy as np

from hdl import records
from hdl.config import Config
from sim.compiler import fields
from sim.compiler.order import Order
from sim.errors import InputError


@dataclass(frozen=True)
class Image:
    """A compiled scene, in memory words of (limbs,) uint32, the lowest limb first.

    The program lies at word 0; vertices, triangles and nodes follow. Vertices and bounds change
    with every frame, the rest is constant. For a machine that does not update trees there is no
    program, and bounds are written with the vertices.

    Attributes
    ----------
    config : Config
    order : Order
        Of the nodes, and of the leaves and so the triangle records.
    instructions : (n,) uint32
    vertices : (V,) int32
        The scene's vertex in each vertex record, in the order in which triangles use them.
    corners : (T, 3) int32
        Vertex records of each triangle record.
    """

    config: Config
    order: Order
    instructions: np.ndarray
    vertices: np.ndarray
    corners: np.ndarray

    def __post_init__(self):
        self.check_fits(self.size)

    def check_fits(self, words: int):
        """Refuse what takes more memory words than the configuration addresses."""
        limit = 1 << self.config.address_bits
        if words > limit:
            raise InputError(
                f"the scene takes {words} memory words and the configuration addresses {limit}: "
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
        return -(-len(self.instructions) // self.limbs)

    @property
    def triangles_at(self) -> int:
        return self.vertices_at + len(self.vertices)

    @property
    def nodes_at(self) -> int:
        return self.triangles_at + len(self.corners)

    @property
    def size(self) -> int:
        """Words in all."""
        return self.nodes_at + self.nodes

    def constant_words(self) -> np.ndarray:
        """The whole image, with all coordinates and bounds zero."""
        words = np.zeros((self.size, self.limbs), np.uint32)
        words[: self.vertices_at].reshape(-1)[: len(self.instructions)] = self.instructions
        triangles = words[self.triangles_at : self.nodes_at]
        for column, name in enumerate(("v0", "v1", "v2")):
            fields.put(triangles, records.TRIANGLE[name], self.corners[:, column])
        words[self.nodes_at :] = self._links()
        return words

    def vertex_words(self, coordinates: np.ndarray) -> np.ndarray:
        """Vertex records (V, limbs) of the bit patterns (scene's vertices, 3) of a frame."""
        words = np.zeros((len(self.vertices), self.limbs), np.uint32)
        layout = records.vertex(self.config.fmt)
        for column, name in enumerate("xyz"):
            fields.put(words, layout[name], coordinates[self.vertices, column])
        return words

    def node_words(self, bounds: np.ndarray) -> np.ndarray:
        """Node records (N, limbs) with the bit patterns (N, 4) of their bounds."""
        words = self._links()
        layout = records.bounds(self.config.fmt)
        for column, (_, field) in enumerate(layout):
            fields.put(words, field, bounds[:, column])
        return words

    def bounds_of(self, words: np.ndarray) -> np.ndarray:
        """Bit patterns (n, 4) of the bounds in node records: the inverse of `node_words`."""
        layout = records.bounds(self.config.fmt)
        return np.stack([fields.get(words, field) for _, field in layout], axis=1)

    def _links(self) -> np.ndarray:
        left, right = self.order.children.T
        words = np.zeros((self.nodes, self.limbs), np.uint32)
        layout = records.node(self.config.fmt)
        fields.put(words, layout["axis"], self.order.axis)
        fields.put(words, layout["left_is_leaf"], left < 0)
        fields.put(words, layout["right_is_leaf"], right < 0)
        fields.put(words, layout["pointer"], np.where(left < 0, ~left, left))
        return words
