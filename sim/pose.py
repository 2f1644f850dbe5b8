"""A scene in one frame: what a machine's memory holds of it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hdl import records
from sim.compiler import fields
from sim.compiler.image import Image
from sim.compiler.partial import corner_words
from sim.model.refit import box_corners, refit
from sim.prepare import Prepared


@dataclass(frozen=True)
class Pose:
    """A scene in a frame, after its update.

    Attributes
    ----------
    prepared : Prepared
        With the trees of this frame.
    frame : int
    bits, rows, bounds : int64 patterns
        Points (V, 3), rows (I, 3, 4) of instances, and bounds (N, 4) of nodes.
    """

    prepared: Prepared
    frame: int
    bits: np.ndarray
    rows: np.ndarray
    bounds: np.ndarray

    @property
    def image(self) -> Image:
        return self.prepared.image

    @property
    def vertices(self) -> np.ndarray:
        """The scene's vertices (V, 3) in float64 where the machine holds them."""
        return self.prepared.vertices(self.bits, self.rows)

    @cached_property
    def words(self) -> np.ndarray:
        """All words (n, limbs) uint32 of the scene."""
        image, fmt = self.image, self.prepared.config.fmt
        words = image.constant_words()
        words[image.vertices_at : image.rows_at] = image.vertex_words(self.bits)
        words[image.rows_at : image.triangles_at] = image.row_words(self.rows)
        words[image.nodes_at : image.still_at] = image.node_words(self.bounds)
        leaves = self.bits[self.prepared.leaf_vertices]
        words[image.still_at :] = corner_words(fmt, box_corners(fmt, leaves, image.still))
        return words

    def before_update(self, bounds: np.ndarray) -> np.ndarray:
        """What the host makes of memory: the words, but with `bounds` where the program writes."""
        image = self.image
        words = self.words.copy()
        held = np.where(image.updated[:, None], bounds, self.bounds)
        words[image.nodes_at : image.still_at] = image.node_words(held)
        return words

    @property
    def vertex_records(self) -> np.ndarray:
        """Patterns (n, 3) of all that the program may load: words from the first vertex on."""
        words = self.words[self.image.vertices_at :]
        layout = records.vertex(self.prepared.config.fmt)
        return np.stack([fields.get(words, layout[axis]) for axis in "xyz"], axis=1)


def pose_of(prepared: Prepared, frame: int) -> Pose:
    """A scene in a frame, with other trees where these have become too dear.

    Raises
    ------
    InputError
        The format is too narrow for the frame.
    """
    prepared = prepared.at(frame)
    bits, rows = prepared.coordinates(frame), prepared.rows(frame)
    bounds = refit(prepared.config.fmt, prepared.image.order, bits[prepared.leaf_vertices])
    return Pose(prepared, frame, bits, rows, bounds)
