"""A colour for each triangle of a scene, by how its part moves."""

from collections.abc import Sequence

import numpy as np

from sim.parts.part import Kind, Part
from sim.report.parts import linear

COLOURS = {
    Kind.STATIC: "c4beb2",
    Kind.STRUCTURED: "3f7fbf",
    Kind.CONTINUOUS: "e2a33b",
    Kind.UNSTRUCTURED: "c4452f",
}
"""sRGB: grey, blue, amber, red; eyes that see no red or no green tell them apart."""


def tints_by_motion(parts: Sequence[Part]) -> np.ndarray:
    """Colours (T, 3), linear in [0, 1], of the triangles of all parts of a scene."""
    colours = np.empty((sum(len(part.faces) for part in parts), 3))
    for part in parts:
        colours[part.faces] = linear([COLOURS[part.kind]])
    return colours
