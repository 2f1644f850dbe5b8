"""Which bytes of memory words travel: only those that mean something."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hdl import records
from hdl.config import Config
from hdl.fp.format import FloatFormat
from hdl.rays.packet import hit
from sim.compiler.image import Image

LINK_BYTES = 4
"""Of a node: the highest ones."""


@dataclass(frozen=True)
class Part:
    """Bytes of each of several words.

    Attributes
    ----------
    name : str
    address : int
        Of the first word.
    first : int
        The first byte of each.
    rows : (n, size) uint8
    """

    name: str
    address: int
    first: int
    rows: np.ndarray

    @property
    def size(self) -> int:
        """Bytes of each word."""
        return self.rows.shape[1]


def word_bytes(fmt: FloatFormat) -> int:
    """Bytes of a memory word."""
    return records.word_bits(fmt) // 8


def vertex_bytes(fmt: FloatFormat) -> int:
    """Bytes of a word that a vertex takes."""
    return -(-records.vertex(fmt).size // 8)


def hit_bytes(config: Config) -> int:
    """Bytes of a word that a hit takes."""
    return -(-hit(config).size // 8)


def hit_head_bytes(config: Config) -> int:
    """Bytes of a hit before the first one with bits of its triangle."""
    return hit(config)["triangle"].offset // 8


def constant_parts(image: Image) -> Iterator[Part]:
    """What an upload writes of a scene: all but vertices and bounds."""
    whole, words = word_bytes(image.config.fmt), image.constant_words()
    triangle = records.TRIANGLE.size // 8
    for name, begin, end, first, size in (
        ("program", 0, image.vertices_at, 0, whole),
        ("triangle", image.triangles_at, image.nodes_at, 0, triangle),
        ("link of node", image.nodes_at, image.size, whole - LINK_BYTES, LINK_BYTES),
    ):
        if end > begin:  # a machine that updates no tree has no program
            yield Part(name, begin, first, rows_of(words[begin:end], first, size))


def vertex_part(image: Image, coordinates: np.ndarray) -> Part:
    """The vertices of a frame, of bit patterns (scene's vertices, 3)."""
    rows = rows_of(image.vertex_words(coordinates), 0, vertex_bytes(image.config.fmt))
    return Part("vertex", image.vertices_at, 0, rows)


def bounds_part(image: Image, bounds: np.ndarray) -> Part:
    """The bounds of all nodes, of bit patterns (N, 4): what an update writes."""
    fmt = image.config.fmt
    rows = rows_of(image.node_words(bounds), 0, records.bound_bytes(fmt))
    return Part("bounds of node", image.nodes_at, 0, rows)


def rows_of(words: np.ndarray, first: int, size: int) -> np.ndarray:
    """Bytes (n, size) of words (n, limbs) uint32, from byte `first` on."""
    raw = np.ascontiguousarray(words, "<u4").view(np.uint8)
    return np.ascontiguousarray(raw[:, first : first + size])


def words_of(rows: np.ndarray, limbs: int) -> np.ndarray:
    """Words (n, limbs) uint32 whose first bytes are rows (n, size); the others are zero."""
    raw = np.zeros((len(rows), 4 * limbs), np.uint8)
    raw[:, : rows.shape[1]] = rows
    return raw.view("<u4").astype(np.uint32)


def spans(wanted: np.ndarray, size: int, header: int) -> list[slice]:
    """Runs of neighbours that hold all rows where `wanted` (n,) is set.

    Rows in between go along where their bytes, `size` each, are fewer than the `header` of a run.
    """
    rows = np.flatnonzero(wanted)
    if not len(rows):
        return []
    ends = np.flatnonzero((np.diff(rows) - 1) * size > header)
    first, last = rows[np.r_[0, ends + 1]].tolist(), rows[np.r_[ends, len(rows) - 1]].tolist()
    return [slice(a, b + 1) for a, b in zip(first, last, strict=True)]


def runs_of(part: Part, changed: np.ndarray, header: int) -> list[tuple[int, bytes]]:
    """The rows where `changed` (n,) is set, in runs of neighbours, each with its address."""
    return [
        (part.address + span.start, part.rows[span].tobytes())
        for span in spans(changed, part.size, header)
    ]
