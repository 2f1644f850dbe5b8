"""Affine maps of groups: exact ones are found, and what is unknown of a map is rigid."""

import numpy as np
import pytest

from sim.parts.motion import CONDITION, Groups, applied, invertible
from tests.sim.parts.making import affine, rigid

START = np.zeros(1, np.int64)


def fitted(points, pose, thin=1e-6):
    fit = Groups(points, START, thin).fit(pose)
    return fit.maps[0], fit.distances


def flattened(rng, rank: int, count: int = 12) -> np.ndarray:
    """Points on a random plane, line or point."""
    basis, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return rng.normal(size=(count, rank)) @ basis[:rank] + rng.uniform(-3, 3, 3)


@pytest.mark.parametrize("rank", [0, 1, 2, 3])
@pytest.mark.parametrize("scale", [1e-3, 1.0])
def test_maps_of_many_groups_are_found(rank, scale, rng):
    parts = [scale * flattened(rng, rank, int(rng.integers(6, 30))) for _ in range(50)]
    motions = [affine(rng, 2) for _ in parts]
    poses = np.concatenate([move(part, 1) for move, part in zip(motions, parts, strict=True)])
    starts = np.cumsum([0] + [len(part) for part in parts[:-1]])
    groups = Groups(np.concatenate(parts), starts, 1e-7)
    fit = groups.fit(poses)
    assert (groups.rank == rank).all() and invertible(fit.maps).all()
    assert fit.distances.max() < 1e-12
    for part, move, matrix in zip(parts, motions, fit.maps, strict=True):
        np.testing.assert_allclose(applied(matrix, part), move(part, 1), atol=1e-12)


def test_least_squares(rng):
    """Against numpy's, of what no map takes along."""
    points, pose = rng.normal(size=(2, 40, 3))
    matrix, distances = fitted(points, pose)
    one = np.ones((40, 1))
    expected = np.linalg.lstsq(np.hstack([points, one]), pose)[0].T
    np.testing.assert_allclose(matrix, expected, atol=1e-12)
    np.testing.assert_allclose(distances, np.linalg.norm(applied(matrix, points) - pose, axis=1))


def test_a_rigid_plate_keeps_its_front(rng):
    """Of a plate that moves rigidly the map is found whole."""
    for _ in range(50):
        points, move = flattened(rng, 2), rigid(rng, 2)
        matrix, _ = fitted(points, move(points, 1))
        others = rng.normal(size=(5, 3))
        np.testing.assert_allclose(applied(matrix, others), move(others, 1), atol=1e-12)


def test_a_line_turns_the_shortest_way(rng):
    for _ in range(50):
        points, move = flattened(rng, 1), rigid(rng, 2)
        matrix, _ = fitted(points, 2 * move(points, 1))
        stretch = np.linalg.svd(matrix[:, :3], compute_uv=False)
        np.testing.assert_allclose(stretch, [2, 1, 1], atol=1e-9)
        assert np.linalg.det(matrix[:, :3]) > 0
        along = points[1] - points[0]
        axis = np.cross(along, matrix[:, :3] @ along)
        np.testing.assert_allclose(matrix[:, :3] @ axis, axis, atol=1e-9)  # about no other


def test_a_line_that_turns_right_round():
    points = np.stack([np.linspace(-1, 1, 7), np.zeros(7), np.zeros(7)], axis=1)
    matrix, distances = fitted(points, -points)
    assert distances.max() < 1e-15 and np.linalg.det(matrix[:, :3]) == pytest.approx(1)


def test_what_vanishes_has_no_inverse(rng):
    points = rng.normal(size=(20, 3))
    for pose in (points * 0, points * (1, 1, 0), points * (1, 1, 0.9 / CONDITION)):
        assert not invertible(fitted(points, pose)[0])
    for pose in (points * 1e-9, points * (1, 1, -1), points * (1, 1, 1.1 / CONDITION)):
        assert invertible(fitted(points, pose)[0])
    for rank in (1, 2):
        flat = flattened(rng, rank)
        assert not invertible(fitted(flat, np.ones_like(flat))[0])


def test_what_is_thinner_than_thin_is_a_plate(rng):
    points = flattened(rng, 2)
    axes = np.linalg.svd(points - points.mean(axis=0))[2]
    points = points + 1e-5 * rng.choice([-1, 1], (12, 1)) * axes[2]
    assert Groups(points, START, 3e-5).rank == 2
    assert Groups(points, START, 3e-6).rank == 3
