"""sim.oracle.trace against exact rationals, and what holds of any first hit."""

from fractions import Fraction

import numpy as np
import pytest

from sim.oracle.trace import trace
from sim.scene.builtin.shapes import sphere
from tests.sim.oracle import brute

INF = np.inf
TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]])


def cast(mesh, origins, directions, t_min=0.0, t_max=INF):
    origins, directions = np.broadcast_arrays(
        np.atleast_2d(np.asarray(origins, float)), np.atleast_2d(np.asarray(directions, float))
    )
    count = len(origins)
    return trace(*mesh, origins, directions, np.full(count, t_min), np.full(count, t_max))


def assert_exact(mesh, origins, directions, t_min, t_max):
    """Equal to the rationals; returns the share of rays that hit."""
    truth = trace(*mesh, origins, directions, t_min, t_max)
    corners = mesh[0][mesh[1]]
    for ray in range(len(origins)):
        t, triangles = brute.first_hits(
            corners, origins[ray], directions[ray], t_min[ray], t_max[ray]
        )
        got = f"ray {ray}: {truth.triangle[ray]} at {truth.t[ray]}, exactly {triangles} at {t}"
        if t is None:
            assert truth.triangle[ray] == -1 and truth.t[ray] == INF, got
        else:
            assert truth.triangle[ray] == triangles[0], got
            assert abs(Fraction(float(truth.t[ray])) - t) <= abs(t) * Fraction(1e-12), got
    return (truth.triangle >= 0).mean()


def test_lattice(rng):
    """Small whole numbers: most rays meet edges and corners, lie in planes or are parallel to axes.

    t is exact there, so of equal ones the lower triangle is due.
    """
    for _ in range(8):
        vertices = rng.integers(-3, 4, (12, 3)).astype(float)
        faces = rng.integers(0, 12, (25, 3))  # some without area, some twice
        origins = rng.integers(-4, 5, (120, 3)).astype(float)
        directions = rng.integers(-2, 3, (120, 3)) * rng.choice([-1.0, 1.0], (120, 3))
        assert np.signbit(directions[directions == 0]).any()
        t_min = rng.integers(-2, 2, 120).astype(float)
        t_max = np.where(rng.random(120) < 0.5, INF, rng.integers(0, 4, 120))
        assert assert_exact((vertices, faces), origins, directions, t_min, t_max) > 0.03


def test_random_triangles(rng):
    vertices, faces = rng.standard_normal((60, 3)), np.arange(60).reshape(20, 3)
    origins, directions = 2 * rng.standard_normal((2, 200, 3))
    directions *= 2.0 ** rng.integers(-50, 51, (200, 1))
    limits = np.zeros(200), np.full(200, INF)
    assert assert_exact((vertices, faces), origins, directions, *limits) > 0.1


def test_rays_that_only_rounding_moves_off_an_edge(rng):
    """Aimed at points of edges, and triangles so thin that most of each is edge."""
    vertices = rng.standard_normal((60, 3))
    vertices[2::3] = (vertices[::3] + vertices[1::3]) / 2 + 1e-15 * rng.standard_normal((20, 3))
    faces = np.arange(60).reshape(20, 3)
    share = rng.random((200, 1))
    start = rng.integers(0, 60, 200)
    end = start // 3 * 3 + (start + 1) % 3
    targets = share * vertices[start] + (1 - share) * vertices[end]
    origins = 2 * rng.standard_normal((200, 3))
    limits = np.zeros(200), np.full(200, INF)
    hits = assert_exact((vertices, faces), origins, targets - origins, *limits)
    assert 0.1 < hits < 0.9


@pytest.mark.parametrize("centre", [(0, 0, 0), (0.3, -0.55, 0.2), (1e-9, 0, -0.9)])
def test_no_holes(centre):
    """0 lost of rays from inside a closed mesh at its vertices and at its edges."""
    vertices, faces = sphere(2000)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    middles = vertices[edges].mean(axis=1)
    targets = np.concatenate([vertices, middles]) - centre
    truth = cast((vertices, faces), centre, targets)
    assert (truth.triangle >= 0).all()
    assert np.allclose(truth.t, 1, rtol=1e-12)


def test_order_of_triangles_changes_nothing(rng):
    vertices, faces = sphere(3000)
    vertices = vertices * rng.uniform(0.5, 1, (len(vertices), 1))
    origins, directions = rng.standard_normal((2, 5000, 3))
    truth = cast((vertices, faces), origins, directions)
    order = rng.permutation(len(faces))
    other = cast((vertices, faces[order]), origins, directions)
    hit = truth.triangle >= 0
    assert hit.any() and not hit.all()
    assert (other.t == truth.t).all()
    assert (order[other.triangle[hit]] == truth.triangle[hit]).all()


def test_length_of_directions_scales_t(rng):
    vertices, faces = sphere(300)
    origins, directions = rng.standard_normal((2, 500, 3))
    near = cast((vertices, faces), origins, directions)
    far = cast((vertices, faces), origins, directions * 2.0**-60)
    assert (near.triangle == far.triangle).all()
    assert (far.t == near.t * 2.0**60).all()


def test_of_coincident_triangles_the_lowest_counts(rng):
    vertices = TRIANGLE[0]
    for _ in range(20):
        count = rng.integers(2, 30)
        assert cast((vertices, [[0, 1, 2]] * count), [0.2, 0.3, -1], [0, 0, 1]).triangle == [0]


@pytest.mark.parametrize("z", [-1.0, 1.0])
def test_both_sides_edges_and_corners_are_hit(z):
    points = np.array([[0.2, 0.3], [0, 0], [1, 0], [0, 1], [0.5, 0.5], [0, 0.5], [0.25, 0]])
    origins = np.column_stack([points, np.full(7, z)])
    truth = cast(TRIANGLE, origins, [-0.0, 0.0, -z])
    assert truth.triangle.tolist() == [0] * 7
    assert truth.t.tolist() == [1] * 7
    outside = origins + [[1e-15, 1e-15, 0]] * (points.sum(axis=1) == 1)[:, None]
    assert cast(TRIANGLE, outside, [0, 0, -z]).triangle.tolist() == [0, 0, -1, -1, -1, 0, 0]


@pytest.mark.parametrize(
    "t_min, t_max, hit",
    [
        (0, INF, True),
        (2, 2, True),
        (2, 3, True),
        (1, 2, True),
        (-INF, INF, True),
        (np.nextafter(2, 3), INF, False),
        (0, np.nextafter(2, 1), False),
        (3, 1, False),
        (INF, -INF, False),
    ],
)
def test_limits_are_inclusive(t_min, t_max, hit):
    truth = cast(TRIANGLE, [0.2, 0.2, 1], [0, 0, -0.5], t_min, t_max)
    assert truth.triangle.tolist() == [0 if hit else -1]
    assert truth.t.tolist() == [2 if hit else INF]


def test_surface_behind_and_at_the_origin():
    assert cast(TRIANGLE, [0.2, 0.2, 1], [0, 0, 1]).triangle == [-1]
    assert cast(TRIANGLE, [0.2, 0.2, 1], [0, 0, 1], -5.0).t == [-1]
    at = cast(TRIANGLE, [0.2, 0.2, 0], [0.1, 0, -1])
    assert at.t == [0] and not np.signbit(at.t[0])


def test_nothing_is_hit_by_no_direction_nor_of_no_mesh():
    assert cast(TRIANGLE, [0.2, 0.2, 0], [0, -0.0, 0], -INF).triangle == [-1]
    assert cast(TRIANGLE, [0.2, 0.2, 0], [1, 1, 0]).triangle == [-1]  # in the plane
    assert cast((TRIANGLE[0], [[0, 1, 1]]), [0.5, 0, 1], [0, 0, -1]).triangle == [-1]
    assert cast((TRIANGLE[0], np.empty((0, 3), int)), [0, 0, 1], [0, 0, -1]).triangle == [-1]
    assert len(trace(*TRIANGLE, *np.empty((2, 0, 3)), *np.empty((2, 0))).t) == 0


def test_wrong_input_is_named():
    vertices, faces = TRIANGLE
    ray = np.zeros((1, 3)), np.ones((1, 3)), np.zeros(1), np.ones(1)
    with pytest.raises(ValueError, match="faces name vertices 0 to 3 of 3"):
        trace(vertices, [[0, 1, 3]], *ray)
    with pytest.raises(ValueError, match="triangle 0 is not finite"):
        trace(vertices / 0.5 + [0, 0, INF], faces, *ray)
    with pytest.raises(ValueError, match="ray 0 is not finite"):
        trace(vertices, faces, ray[0], ray[1] * INF, *ray[2:])
    with pytest.raises(ValueError, match="rays are"):
        trace(vertices, faces, ray[0], ray[1], ray[2], np.ones(2))
    with pytest.raises(ValueError, match="a mesh is"):
        trace(vertices[:, :2], faces, *ray)
