"""sim.oracle.distance against points tried one by one."""

import numpy as np
import pytest

from sim.oracle.distance import line_outline, point_segment, point_triangle

STEPS = 200


def on_segment(a, b):
    share = np.linspace(0, 1, STEPS + 1)[:, None]
    return (1 - share) * a + share * b


def on_triangle(a, b, c):
    u, v = np.meshgrid(np.linspace(0, 1, STEPS + 1), np.linspace(0, 1, STEPS + 1))
    u, v = u[u + v <= 1 + 1e-9, None], v[u + v <= 1 + 1e-9, None]
    return a + u * (b - a) + v * (c - a)


def assert_least(distance, tried, spacing):
    """No point tried is nearer, and one is hardly farther."""
    assert distance <= tried.min() + 1e-12
    assert distance >= tried.min() - spacing - 1e-12


def corners_at_random(rng, shape):
    a, b, c = rng.standard_normal((3, 3))
    if shape == "thin":
        c = (a + b) / 2 + 1e-3 * c
    if shape == "line":
        c = a + 2.0 * (b - a)
    if shape == "point":
        b = c = a.copy()
    return a, b, c


@pytest.mark.parametrize("shape", ["any", "thin", "line", "point"])
def test_distances_are_least(rng, shape):
    for _ in range(60):
        a, b, c = corners_at_random(rng, shape)
        p, direction = rng.standard_normal((2, 3))
        p = p + (a + b + c) / 3 if rng.random() < 0.5 else (a + b + c) / 3 + 0.1 * p
        spacing = max(np.linalg.norm(q - r) for q, r in ((a, b), (b, c), (c, a))) / STEPS
        to_segment = np.linalg.norm(on_segment(a, b) - p, axis=1)
        assert_least(point_segment(p, a, b), to_segment, spacing)
        to_triangle = np.linalg.norm(on_triangle(a, b, c) - p, axis=1)
        assert_least(point_triangle(p, a, b, c), to_triangle, spacing)

        outline = np.concatenate([on_segment(a, b), on_segment(b, c), on_segment(c, a)]) - p
        across = np.cross(outline, direction) / np.linalg.norm(direction)
        tried = np.linalg.norm(across, axis=1)
        assert_least(line_outline(p, direction, a, b, c), tried, spacing)


def test_inside_of_the_surface_and_past_its_sides():
    a, b, c = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    for p, distance in [
        ((1, 1, 0.5), 0.5),
        ((1, 1, -0.5), 0.5),
        ((1, 1, 0), 0),
        ((2, -3, 4), 5),
        ((-3, -4, 0), 5),
        ((3, 3, 0), 2**0.5),
    ]:
        assert point_triangle(np.array(p, float), a, b, c) == pytest.approx(distance, abs=1e-15)
        assert point_triangle(np.array(p, float), b, a, c) == pytest.approx(distance, abs=1e-15)


def test_outline_is_the_edges_and_not_the_inside():
    a, b, c = np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0]])
    down = np.array([0, 0, -2.0])
    assert line_outline(np.array([1, 0.5, 9]), down, a, b, c) == 0.5
    assert line_outline(np.array([1, -0.5, -9]), down, a, b, c) == 0.5  # behind counts
    assert line_outline(np.array([-3.0, -4, 9]), down, a, b, c) == 5
    along = np.array([1.0, 0, 0])  # in the plane, through the middle
    assert line_outline(np.array([-9, 1, 0.0]), along, a, b, c) == 0
    assert line_outline(np.array([-9, 1, 0.25]), along, a, b, c) == 0.25
    assert line_outline(np.array([0, 3.0, 0]), np.zeros(3), a, b, c) == 0
