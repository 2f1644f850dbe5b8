"""sim.scene.normalise: the box, the power of two, and the way back, in exact arithmetic."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.errors import InputError
from sim.scene.normalise import normalise
from sim.scene.scene import Scene

FACES = np.array([[0, 1, 2]], np.int32)


def scene_of(vertices) -> Scene:
    vertices = np.array(vertices, np.float64)
    return Scene("s", FACES, len(vertices), lambda frame: vertices[frame].copy())


def posed(result) -> np.ndarray:
    return np.stack([result.scene.pose(frame) for frame in result.frames])


@pytest.mark.parametrize("magnitude", [1, 3, 1e-300, 1e300, 1.7e308, 1e-320, 5e-324, 2.0**-1022])
def test_any_magnitude(magnitude, rng):
    """Each pose is (vertex - centre) / 2**exponent, rounded once; the largest fills (0.5, 1]."""
    vertices = rng.uniform(-1, 1, (3, 8, 3)) * magnitude
    result = normalise(scene_of(vertices))
    points = posed(result)
    assert 0.5 < np.abs(points).max() <= 1
    scale = Fraction(2) ** result.exponent
    for axis in range(3):
        low, high = vertices[..., axis].min(), vertices[..., axis].max()
        middle = (Fraction(low) + Fraction(high)) / 2
        error = abs(Fraction(result.centre[axis]) - middle)
        assert error <= Fraction(max(np.spacing(abs(high)), np.spacing(abs(low))))
    for vertex, point in zip(vertices.reshape(-1, 3), points.reshape(-1, 3), strict=True):
        for v, c, p in zip(vertex, result.centre, point, strict=True):
            assert Fraction(float(v - c)) == Fraction(p) * scale


@pytest.mark.parametrize("exponent", [-1000, -1, 0, 1, 1000])
def test_a_power_of_two_is_exact_and_fills_the_range(exponent):
    """Half an extent of exactly 2**k becomes 1, not 0.5."""
    size = 2.0**exponent
    result = normalise(scene_of([[[-size, 0, 0], [size, size / 4, 0], [0, 0, 0]]]))
    assert result.exponent == exponent
    assert posed(result)[0].tolist() == [[-1, -0.125, 0], [1, 0.125, 0], [0, -0.125, 0]]


def test_one_point_and_a_flat_scene():
    result = normalise(scene_of([[[5, -6, 7]] * 3]))
    assert (result.exponent, result.centre.tolist()) == (0, [5, -6, 7])
    assert posed(result).tolist() == [[[0, 0, 0]] * 3]
    result = normalise(scene_of([[[5, -6, 1e-310]] * 3]))
    assert posed(result).tolist() == [[[0, 0, 0]] * 3]


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=9, max_size=9),
    st.lists(st.floats(-1, 1), min_size=3, max_size=3),
)
@settings(max_examples=100, deadline=None)
def test_points_and_source_points_undo_each_other(values, point):
    vertices = np.reshape(values, (1, 3, 3))
    result = normalise(scene_of(vertices))
    np.testing.assert_array_equal(result.points(vertices[0]), result.scene.pose(0))
    unit = 2.0**result.exponent
    there = result.source_points(np.array(point))
    limit = 4 * np.spacing(unit + np.abs(result.centre))
    assert (np.abs(there - (np.multiply(point, unit) + result.centre)) <= limit).all()
    assert (np.abs(result.points(there) - point) * unit <= limit).all()
    back = result.source_points(result.points(vertices))
    assert (np.abs(back - vertices) <= limit).all()


def test_only_the_frames_asked_for_count():
    """They keep their numbers, and the others may lie outside."""
    vertices = np.arange(4)[:, None, None] * np.array([[1, 0, 0], [-1, 0, 0], [0, 0.5, 0]])
    scene = scene_of(vertices)
    for frames, exponent in (
        (range(1, 2), 0),
        (range(1, 3), 1),
        (range(3, 4), 2),
        (range(3, 0, -2), 2),
    ):
        result = normalise(scene, frames)
        assert result.frames == frames and result.exponent == exponent
        assert result.scene.frames == 4 and result.scene.faces is scene.faces
        assert 0.5 < np.abs(posed(result)).max() <= 1
    assert normalise(scene).frames == range(4)
    assert np.abs(normalise(scene, range(1, 2)).scene.pose(3)).max() == 3


@pytest.mark.parametrize(
    "frames", [range(0), range(4, 5), range(-1, 2), range(3, 5), range(5, 1, -1)]
)
def test_frames_that_do_not_exist(frames):
    with pytest.raises(InputError, match="^s: (no frame chosen|has no frame -?[0-9]+).*0 to 3$"):
        normalise(scene_of(np.ones((4, 3, 3))), frames)


@pytest.mark.parametrize(
    ("value", "word"), [(np.nan, "NaN"), (np.inf, "infinite"), (-np.inf, "infinite")]
)
def test_what_is_not_finite_is_named(value, word):
    vertices = np.ones((3, 3, 3))
    vertices[1, 2, 0] = value
    with pytest.raises(InputError, match=f"^s: frame 1, vertex 2 is {word} .*$"):
        normalise(scene_of(vertices))
    normalise(scene_of(vertices), range(2, 3))


def test_poses_are_computed_when_asked_for():
    asked = []

    def pose(frame):
        asked.append(frame)
        return np.array([[0, 0, frame], [1, 0, 0], [0, 1, 0]], float)

    result = normalise(Scene("s", FACES, 6, pose), range(2, 5))
    assert asked == [2, 3, 4]
    result.scene.pose(3)
    assert asked == [2, 3, 4, 3]
