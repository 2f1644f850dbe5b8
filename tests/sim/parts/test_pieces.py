"""What hangs together."""

import numpy as np
import pytest

from sim.parts.pieces import pieces, welded
from sim.parts.sort import sort_pieces
from sim.scene.merge import coinciding
from tests.sim.parts.making import bend, plate, rigid, scene_of, with_loose_vertex


def by_search(faces: np.ndarray) -> list[int]:
    """Piece of each triangle, from the definition."""
    piece = [-1] * len(faces)
    for start in range(len(faces)):
        if piece[start] >= 0:
            continue
        number, todo = max(piece) + 1, [start]
        while todo:
            face = todo.pop()
            piece[face] = number
            near = np.isin(faces, faces[face]).any(axis=1)
            todo += [int(k) for k in np.flatnonzero(near) if piece[k] < 0]
    return piece


@pytest.mark.parametrize("count", [1, 5, 40, 90])
def test_against_a_search(count, rng):
    for _ in range(20):
        faces = rng.integers(0, 90, (count, 3))
        assert pieces(faces, 90).tolist() == by_search(faces)


def test_a_seam_is_closed_where_it_moves():
    """A plate whose halves share no vertex, beside a wall on which a row of it is pinned."""
    left, right = plate((0, 0, 0)), plate((1, 0, 0))
    wall = plate((0, 0, -1))  # its row z = 0 is where the left half begins
    motion = rigid(np.random.default_rng(1), 3)

    def pinned(points, frame):
        return np.where(points[:, 2:] > 0, motion(points, frame), points)

    scene = scene_of(3, (left, pinned), (right, pinned), (wall, None))
    first = coinciding(scene, range(3))
    rest = scene.pose(0)
    moves = (scene.pose(1) != rest).any(axis=1)
    assert pieces(scene.faces, len(rest)).max() == 2
    assert welded(scene.faces, first, moves).tolist() == [0] * 36 + [1] * 18
    # two walls at rest that touch are one piece
    still = scene_of(3, (left, None), (right, None), (wall, None))
    assert not welded(still.faces, coinciding(still, range(3)), np.zeros(len(rest), bool)).any()


def test_a_vertex_that_no_triangle_uses_is_in_no_part():
    scene = with_loose_vertex(scene_of(3, (plate((0, 0, 0)), bend)), 4)
    (part,) = sort_pieces(scene, range(3), 1e-6, lambda _: None)
    assert part.vertices.tolist() == [0, 1, 2, 3, *range(5, 17)]
