"""Sorting the pieces of a scene into parts."""

from collections.abc import Callable

import numpy as np

from sim.parts.adjacent import adjacent
from sim.parts.common import LEAST
from sim.parts.divide import Moving, divide, samples_of
from sim.parts.part import Kind, Part
from sim.parts.pieces import welded
from sim.scene.merge import coinciding
from sim.scene.scene import Scene


def sort_pieces(
    scene: Scene, frames: range, error: float, step: Callable[[str], None]
) -> list[Part]:
    """Parts by their first triangles, those that deform taken for continuous; nothing is fitted.

    Parameters
    ----------
    scene : Scene
        Normalised.
    frames : range
    error : float
    step : callable
        Told what begins.
    """
    step("finding pieces")
    rest = scene.pose(frames[0])
    moves = np.zeros(len(rest), bool)
    for frame in frames[1:]:
        moves |= (scene.pose(frame) != rest).any(axis=1)
    first = coinciding(scene, frames)
    piece = welded(scene.faces, first, moves)

    part = np.zeros(int(piece.max()) + 1, np.int64)  # of each piece, in any order; 0 is at rest
    going = np.unique(piece[moves[scene.faces].any(axis=1)])
    kinds = [Kind.STATIC]
    if len(going):
        step("finding common motion")
        moving = _moving(scene.faces, first, piece, going)
        group = divide(scene.pose, frames, moving, error)
        kinds += [Kind.STRUCTURED] * (int(group.max()) + 1)
        bends = group < 0
        group[bends] = len(kinds) - 1 + _beside(scene, frames, moving, bends)
        part[going] = 1 + group
        kinds += [Kind.CONTINUOUS] * (int(part.max()) + 1 - len(kinds))
    return _parts(scene.faces, piece, part, kinds)


def _moving(faces: np.ndarray, first: np.ndarray, piece: np.ndarray, going: np.ndarray) -> Moving:
    """The pieces that move."""
    of_vertex = np.full(len(first), -1)
    of_vertex[faces] = piece[:, np.newaxis]
    vertices = np.flatnonzero(np.isin(of_vertex, going))
    vertices = vertices[np.argsort(of_vertex[vertices], kind="stable")]
    starts = np.searchsorted(of_vertex[vertices], going)
    distinct = np.unique(of_vertex[vertices] * len(first) + first[vertices]) // len(first)
    return Moving(vertices, starts, np.bincount(np.searchsorted(going, distinct)))


def _beside(scene: Scene, frames: range, moving: Moving, bends: np.ndarray) -> np.ndarray:
    """Groups, from 0, of the pieces that bend."""
    if not bends.any():
        return np.zeros(0, np.int64)
    rows = bends[moving.piece]
    counts = np.diff(moving.starts, append=len(moving.vertices))[bends]
    starts = np.cumsum(counts) - counts
    low, high = [], []
    for frame in [frames[0], *samples_of(frames)]:
        points = scene.pose(frame)[moving.vertices[rows]]
        low.append(np.minimum.reduceat(points, starts))
        high.append(np.maximum.reduceat(points, starts))
    return adjacent(np.stack(low), np.stack(high), moving.sizes[bends] >= LEAST)


def _parts(faces: np.ndarray, piece: np.ndarray, part: np.ndarray, kinds: list[Kind]) -> list[Part]:
    pieces = np.bincount(part, minlength=len(kinds))
    of_face = part[piece]
    order = np.argsort(of_face, kind="stable")
    numbers, starts = np.unique(of_face[order], return_index=True)
    members = np.split(order.astype(np.int32), starts[1:])
    found = [
        Part(kinds[number], ids, np.unique(faces[ids]).astype(np.int32), int(pieces[number]))
        for number, ids in zip(numbers.tolist(), members, strict=True)
    ]
    return sorted(found, key=lambda part: part.faces[0])
