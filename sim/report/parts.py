"""Which triangles of a mesh hang together, and a quiet colour for each part."""

from collections.abc import Iterable

import numpy as np

from sim.parts.pieces import pieces

PALETTE = ["c8bca8", "7f9bb5", "93a878", "bf7d68", "cdb56c", "9a88aa"]
"""Colours of the parts, sRGB, from the largest on."""


def tints(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Colours (T, 3), linear in [0, 1], of a mesh's triangles: one a part, the largest first.

    To keep them over an animation, take the vertices (V, 3) of one frame.
    """
    colours = linear(PALETTE)
    corner = vertices[faces]
    areas = np.linalg.norm(
        np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1
    )
    part = parts(vertices, faces)
    size = np.bincount(part, areas)
    rank = np.empty(len(size), np.int64)
    rank[np.argsort(-size, kind="stable")] = np.arange(len(size))
    return colours[rank[part] % len(colours)]


def linear(colours: Iterable[str]) -> np.ndarray:
    """Colours (n, 3), linear in [0, 1], of sRGB ones."""
    return (np.array([list(bytes.fromhex(colour)) for colour in colours]) / 255) ** 2.2


def parts(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Number (T,) of each triangle's part, from 0 in order of their first triangles.

    Triangles hang together where corners lie in the same place: the sides of a box, which share
    no vertex if their edges are sharp, are one part.
    """
    _, place = np.unique(vertices, axis=0, return_inverse=True)
    return pieces(place.reshape(-1)[faces], len(vertices))
