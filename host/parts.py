"""Which bytes of memory words travel: only those that mean something."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from hdl import records
from hdl.config import Config
from hdl.fp.format import FloatFormat
from hdl.rays.packet import hit
from sim.compiler.image import Image
from sim.pose import Pose

BOUNDS = "bounds of node"
LINK_BYTES = 4
"""Of a node: the highest ones."""


@dataclass(frozen=True)
class Part:
    """Bytes of each of several words.

    Attributes
    ----------
    name : str
    words : range
        Addresses.
    first : int
        The first byte of each.
    size : int
        Bytes of each.
    """

    name: str
    words: range
    first: int
    size: int

    @property
    def bytes(self) -> int:
        """Of all."""
        return len(self.words) * self.size

    def rows(self, memory: np.ndarray) -> np.ndarray:
        """Them (n, size) uint8 of a memory of words (m, limbs) uint32."""
        raw = np.ascontiguousarray(memory[self.words.start : self.words.stop], "<u4")
        return raw.view(np.uint8)[:, self.first : self.first + self.size]


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


def parts_of(image: Image) -> Iterator[Part]:
    """All that means something in the memory of a scene."""
    fmt, regions = image.config.fmt, image.regions
    whole, vertex = word_bytes(fmt), vertex_bytes(fmt)
    with_flag = image.config.instances
    triangle = records.TRIANGLE.size if with_flag else records.TRIANGLE["is_instance"].offset
    program = range(-(-len(image.instructions) // image.limbs))  # without the room behind it
    for part in (
        Part("program", program, 0, whole),
        Part("vertex", regions["vertex"], 0, vertex),
        Part("row", regions["row"], 0, whole),
        Part("triangle", regions["triangle"], 0, -(-triangle // 8)),
        Part(BOUNDS, regions["node"], 0, records.bound_bytes(fmt)),
        Part("link of node", regions["node"], whole - LINK_BYTES, LINK_BYTES),
        Part("corner", regions["corner"], 0, vertex),
    ):
        if part.words:
            yield part


def upload_bytes(image: Image) -> int:
    """Bytes that travel for a first frame: all but the bounds that the update writes."""
    updated = int(image.updated.sum()) * records.bound_bytes(image.config.fmt)
    return sum(part.bytes for part in parts_of(image)) - updated


def changes(pose: Pose, before: Pose | None, header: int) -> list[tuple[Part, list]]:
    """What the host has to write: for each part runs of words, each an address and its bytes.

    Bounds that the update writes do not travel.

    Parameters
    ----------
    before : Pose, optional
        What is there; all travels, if nothing is known.
    header : int
        Bytes that a run takes beside its words.
    """
    found = []
    for part in parts_of(pose.image):
        rows = part.rows(pose.words)
        wanted = np.ones(len(rows), np.bool_)
        if before:
            wanted = (rows != part.rows(before.words)).any(axis=1)
        if part.name == BOUNDS:
            wanted &= ~pose.image.updated
        if wanted.any():
            found.append((part, runs_of(part.words.start, rows, wanted, header)))
    return found


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


def runs_of(
    address: int, rows: np.ndarray, wanted: np.ndarray, header: int
) -> list[tuple[int, bytes]]:
    """The rows where `wanted` (n,) is set, in runs of neighbours, each with its address."""
    return [
        (address + span.start, rows[span].tobytes())
        for span in spans(wanted, rows.shape[1], header)
    ]
