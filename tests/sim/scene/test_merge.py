"""sim.scene.merge: which vertices become one, against all pairs compared."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.errors import InputError
from sim.scene.merge import merge_vertices
from sim.scene.scene import Scene


def scene_of(vertices, faces=None) -> Scene:
    vertices = np.array(vertices, np.float64)
    if faces is None:
        faces = np.arange(vertices.shape[1] // 3 * 3).reshape(-1, 3)
    return Scene(
        "s", np.array(faces, np.int32), len(vertices), lambda frame: vertices[frame].copy()
    )


def first_of_each(vertices: np.ndarray) -> list[int]:
    """For each vertex the first one that is equal in all frames, by comparing pairs."""
    count = vertices.shape[1]
    return [
        next(b for b in range(count) if all(tuple(f[a]) == tuple(f[b]) for f in vertices))
        for a in range(count)
    ]


# few values, so that most vertices meet another in some frame, and many in all
MOTIONS = st.integers(1, 4).flatmap(
    lambda frames: st.integers(3, 12).flatmap(
        lambda count: st.lists(
            st.sampled_from([0.0, -0.0, 1.0, -5e-324]),
            min_size=frames * count * 3,
            max_size=frames * count * 3,
        ).map(lambda values: np.array(values).reshape(frames, count, 3))
    )
)
PLANAR = MOTIONS.map(lambda vertices: vertices * (1, 0, 0))


@given(MOTIONS | PLANAR)
@settings(max_examples=150, deadline=None)
def test_merges_what_is_equal_in_all_frames(vertices):
    scene = merge_vertices(scene_of(vertices))
    first = first_of_each(vertices)
    kept = sorted(set(first))
    expected = [kept.index(first[k]) for k in range(vertices.shape[1] // 3 * 3)]
    assert scene.faces.ravel().tolist() == expected
    assert scene.faces.dtype == np.int32 and scene.frames == len(vertices)
    for frame in range(len(vertices)):
        np.testing.assert_array_equal(scene.pose(frame), vertices[frame][kept])


def test_a_vertex_that_leaves_and_comes_back_stays_apart():
    together, apart = [[1, 2, 3]] * 4, [[1, 2, 3], [1, 2, 3], [1, 2, 4], [1, 2, 4]]
    scene = merge_vertices(scene_of([together, apart, together], [[0, 1, 2], [1, 2, 3]]))
    assert scene.faces.tolist() == [[0, 0, 1], [0, 1, 1]]
    again = merge_vertices(scene_of([apart, together, together], [[0, 1, 2], [1, 2, 3]]))
    assert again.faces.tolist() == scene.faces.tolist()


def test_zeros_of_both_signs_are_one():
    scene = merge_vertices(scene_of([[[0.0, -0.0, 0.0], [-0.0, 0.0, -0.0], [0, 0, 1]]]))
    assert scene.faces.tolist() == [[0, 0, 1]]


def test_vertices_of_no_triangle_stay():
    vertices = [[[9, 9, 9], [1, 0, 0], [2, 0, 0], [3, 0, 0], [1, 0, 0]]]
    scene = merge_vertices(scene_of(vertices, [[4, 2, 3]]))
    assert scene.faces.tolist() == [[1, 2, 3]]
    assert scene.pose(0).tolist() == vertices[0][:4]


def test_every_frame_is_posed_once_and_none_is_kept():
    """Merging takes each frame once; afterwards a frame is computed when it is asked for."""
    asked = []

    def pose(frame):
        asked.append(frame)
        return np.array([[0, 0, frame], [1, 0, 0], [0, 1, 0], [0, 0, frame]], float)

    scene = merge_vertices(Scene("s", np.array([[0, 1, 2], [3, 2, 1]], np.int32), 5, pose))
    assert sorted(set(asked)) == list(range(5)) and len(asked) <= 6  # frame 0 for the count
    asked.clear()
    assert scene.pose(3)[0].tolist() == [0, 0, 3] and asked == [3]
    scene.pose(3)[:] = 77
    assert scene.pose(3)[0].tolist() == [0, 0, 3]


@pytest.mark.parametrize(("value", "word"), [(np.nan, "NaN"), (-np.inf, "infinite")])
def test_what_is_not_finite_is_named(value, word):
    vertices = np.zeros((4, 6, 3))
    vertices[2, 5, 1] = value
    with pytest.raises(InputError, match=f"^s: frame 2, vertex 5 is {word} .*$"):
        merge_vertices(scene_of(vertices))
