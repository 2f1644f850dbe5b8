"""sim.scene.gltf: animation of nodes, against positions from other formulas."""

import numpy as np
import pytest

from tests.sim.scene.gltf_files import CORNERS, File, about, corners, turned

CLOSE = {"rtol": 0, "atol": 2e-6}  # the file's numbers are float32
FAR = 999.0  # tangents that nothing may use


def animated(path: str, times, values, interpolation=None, **node) -> File:
    file = File()
    file.add("nodes", mesh=file.mesh(), **node)
    file.animation(0, path, times, values, interpolation)
    return file


def check(scene, fps: float, place) -> None:
    """Every frame's triangle is `place(time, corner)`."""
    for frame in range(scene.frames):
        expected = [place(frame / fps, np.array(corner, float)) for corner in CORNERS]
        np.testing.assert_allclose(corners(scene, frame)[0], expected, **CLOSE)


@pytest.mark.parametrize(
    ("duration", "fps", "frames"), [(1, 24, 25), (0.7, 10, 8), (0.75, 10, 8), (2, 0.25, 1)]
)
def test_frames_are_samples_in_time(duration, fps, frames, tmp_path):
    """0.7 is a little less as float32, and is a frame all the same."""
    file = animated("translation", [0, duration], [(0, 0, 0), (duration, 0, 0)])
    scene = file.load(tmp_path, fps=fps)
    assert scene.frames == frames
    check(scene, fps, lambda t, p: p + (t, 0, 0))


def test_24_frames_a_second_unless_told(tmp_path):
    assert animated("scale", [0, 2], [(1, 1, 1), (2, 2, 2)]).load(tmp_path).frames == 49


def test_linear_translation_and_scale(tmp_path):
    """The first key is at 0.5 s: before it the first value holds, not the node's."""
    times, a, b, c = [0.5, 1, 3], np.array((1, 2, 4)), np.array((2, 2, 8)), np.array((-1, 0, 1))

    def value(t):
        if t < 1:
            return a + max(t - 0.5, 0) * 2 * (b - a)
        return b + (t - 1) / 2 * (c - b)

    keys = [a.tolist(), b.tolist(), c.tolist()]
    scene = animated("translation", times, keys, translation=[9, 9, 9]).load(tmp_path, fps=8)
    check(scene, 8, lambda t, p: p + value(t))
    scene = animated("scale", times, keys, translation=[9, 9, 9]).load(tmp_path, fps=8)
    check(scene, 8, lambda t, p: p * value(t) + 9)


@pytest.mark.parametrize("interpolation", [None, "LINEAR"])
@pytest.mark.parametrize("degrees", [40, 179, 181, 300, 0, 1e-5])
def test_linear_rotation_is_even_and_takes_the_short_way(interpolation, degrees, tmp_path):
    """Between two turns about one axis: the angle grows evenly, by the difference modulo 360."""
    axis, start = (1, -2, 2), 25
    keys = [about(axis, start), about(axis, start + degrees)]
    scene = animated("rotation", [0, 2], keys, interpolation).load(tmp_path, fps=5)
    way = degrees if degrees <= 180 else degrees - 360
    check(scene, 5, lambda t, p: turned(about(axis, start + way * t / 2), p))


@pytest.mark.parametrize("path", ["translation", "scale", "rotation"])
def test_step_holds_each_key(path, tmp_path):
    """The keys of a rotation need not be of length 1 to the last bit."""
    a, b = (
        ((1, 2, 3), (4, 0, 9)) if path != "rotation" else (about((1, 0, 1), 80), (0, 0.6, 0, 0.8))
    )
    longer = [tuple(1.001 * x for x in q) if path == "rotation" else q for q in (a, b)]
    scene = animated(path, [0, 0.5], longer, "STEP").load(tmp_path, fps=8)
    assert scene.frames == 5
    place = {
        "translation": lambda v, p: p + v,
        "scale": lambda v, p: p * v,
        "rotation": turned,
    }[path]
    check(scene, 8, lambda t, p: place(a if t < 0.5 else b, p))


@pytest.mark.parametrize("path", ["translation", "scale", "rotation"])
def test_cubic_spline_draws_cubics_exactly(path, tmp_path, rng):
    """Keys and tangents are of two cubics, which meet at the middle key: the spline is they."""
    width, times = (4 if path == "rotation" else 3), (0.25, 0.75, 3.0)
    first, second = (
        [np.polynomial.Polynomial(row) for row in rng.uniform(-1, 1, (width, 4))] for _ in range(2)
    )
    first = [f + 3 for f in first]  # far from 0, where a rotation has no direction
    second = [s - s(times[1]) + f(times[1]) for f, s in zip(first, second, strict=True)]
    if path == "rotation":  # gently, as the second span is long
        second = [
            f(times[1]) + (s - f(times[1])) * 0.05 for f, s in zip(first, second, strict=True)
        ]

    def at(curves, t, order=0):
        return tuple(float(curve.deriv(order)(t) if order else curve(t)) for curve in curves)

    values = [(FAR,) * width, at(first, times[0]), at(first, times[0], 1)]
    values += [at(first, times[1], 1), at(first, times[1]), at(second, times[1], 1)]
    values += [at(second, times[2], 1), at(second, times[2]), (FAR,) * width]
    scene = animated(path, times, values, "CUBICSPLINE").load(tmp_path, fps=16)
    assert scene.frames == 49

    def place(t, p):
        value = at(first if t < times[1] else second, max(t, times[0]))
        if path == "rotation":
            return turned(np.divide(value, np.linalg.norm(value)), p)
        return p + value if path == "translation" else p * value

    for frame in range(scene.frames):
        expected = [place(frame / 16, np.array(corner, float)) for corner in CORNERS]
        np.testing.assert_allclose(corners(scene, frame)[0], expected, rtol=1e-5, atol=2e-5)


def test_animations_by_name_and_number(tmp_path):
    file = File()
    file.add("nodes", mesh=file.mesh())
    for number, name in enumerate(["walk", "run", "0"]):
        end = (number + 1.0, 0, 0)
        file.animation(0, "translation", [0, 1], [(0, 0, 0), end], name=name)
    file.animation(0, "translation", [0, 1], [(0, 0, 0), (4, 0, 0)])  # has no name
    for wanted, end in ((None, 1), ("walk", 1), ("run", 2), ("1", 2), ("0", 3), ("2", 3), ("3", 4)):
        scene = file.load(tmp_path, fps=1, animation=wanted)
        np.testing.assert_array_equal(corners(scene, 1)[0], np.add(CORNERS, (end, 0, 0)))
