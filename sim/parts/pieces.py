"""Which triangles of a mesh hang together."""

import numpy as np
from numba import njit


def pieces(faces: np.ndarray, places: int) -> np.ndarray:
    """Number (T,) of each triangle's piece, from 0 in order of their first triangles.

    Parameters
    ----------
    faces : (T, 3) int
        The place of each corner: triangles with a place in common are of one piece.
    places : int
        All are below it.
    """
    return _pieces(np.ascontiguousarray(faces, np.int64), places)


def welded(faces: np.ndarray, first: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Number (T,) of each triangle's piece, with seams closed.

    Files split a vertex where texture or normals have a seam: vertices that coincide in all
    frames join triangles as one vertex does. Except where what moves touches what is at rest, as
    a curtain its rail: vertices that do not move join triangles of which none moves.

    Parameters
    ----------
    faces : (T, 3) int32
    first : (V,) int64
        Of `sim.scene.merge.coinciding`.
    moves : (V,) bool
        Vertices that are elsewhere in some frame.
    """
    count = len(first)
    piece = pieces(faces, count)
    goes = np.zeros(len(faces), bool)
    goes[piece[moves[faces].any(axis=1)]] = True
    at_rest = np.zeros(count, bool)
    at_rest[faces[~goes[piece]]] = True
    place = np.where(moves, first, np.where(at_rest, first + count, np.arange(count)))
    return pieces(place[faces], 2 * count)


@njit("int64[::1](int64[:, ::1], int64)", cache=True)
def _pieces(faces, places):
    parent = np.arange(places)  # a place nearer the root of its piece's tree, or itself

    for a, b, c in faces:
        root = a
        for corner in (a, b, c):
            at = corner
            while parent[at] != at:
                parent[at] = parent[parent[at]]
                at = parent[at]
            if corner == a:
                root = at
            else:
                parent[at] = root
    number = np.full(places, -1)
    piece = np.empty(len(faces), np.int64)
    count = 0
    for face in range(len(faces)):
        at = faces[face, 0]
        while parent[at] != at:
            at = parent[at]
        if number[at] < 0:
            number[at] = count
            count += 1
        piece[face] = number[at]
    return piece
