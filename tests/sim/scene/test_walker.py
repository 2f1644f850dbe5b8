"""The walker: a closed surface of a person's size, and what makes its motion a walk."""

import numpy as np
import pytest

from sim.scene.load import load_scene

SIZES = [428, 600, 1000, 2000, 20_000, 80_000]


def areas(corners: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(corners, -2, 0)
    return np.linalg.norm(np.cross(b - a, c - a), axis=-1) / 2


@pytest.mark.parametrize("triangles", SIZES)
def test_a_closed_manifold(triangles):
    """Each edge has two triangles that run along it in opposite ways; no holes, no handles."""
    scene = load_scene(f"walker:{triangles}")
    faces = scene.faces.astype(np.int64)
    count = len(scene.pose(0))
    edges = np.concatenate([faces, np.roll(faces, -1, axis=1)], axis=1).reshape(-1, 2, 3)
    there = (edges[:, 0] * count + edges[:, 1]).ravel()
    back = (edges[:, 1] * count + edges[:, 0]).ravel()
    assert len(np.unique(there)) == len(there)
    np.testing.assert_array_equal(np.sort(there), np.sort(back))
    assert np.unique(faces).tolist() == list(range(count))
    assert count - len(there) // 2 + len(faces) == 2

    piece = np.arange(count)  # one piece: the smallest number reaches all
    ends = np.unique(np.sort(edges.transpose(0, 2, 1).reshape(-1, 2), axis=1), axis=0)
    while True:
        before = piece.copy()
        lower = piece[ends].min(axis=1)
        np.minimum.at(piece, piece[ends[:, 0]], lower)
        np.minimum.at(piece, piece[ends[:, 1]], lower)
        piece = piece[piece]
        if (piece == before).all():
            break
    assert (piece == 0).all()


@pytest.mark.parametrize("triangles", SIZES)
def test_no_triangle_vanishes_and_the_inside_is_inside(triangles):
    """A person of 1.78 m has some 70 litres; they are the same in every pose within a sixth."""
    scene = load_scene(f"walker:{triangles}")
    volumes = []
    for frame in (0, 5, 11, 18):
        corners = scene.pose(frame)[scene.faces]
        assert areas(corners).min() > 1e-4 * areas(corners).mean()
        a, b, c = np.moveaxis(corners, 1, 0)
        volumes.append(np.einsum("ij,ij", a, np.cross(b, c)) / 6)
        height = np.ptp(scene.pose(frame)[:, 1])
        assert 1.6 < height < 1.85
    assert 0.05 < min(volumes) and max(volumes) < 0.11 and max(volumes) < 1.17 * min(volumes)


@pytest.fixture(scope="module")
def walk():
    """Vertices (F, V, 3) of one period in 40 frames."""
    scene = load_scene("walker:4000", period=40)
    return np.stack([scene.pose(frame) for frame in range(40)])


def leg(walk, side: int, low: float, high: float) -> np.ndarray:
    """Vertices (F, N, 3) of a slice of a leg: side 1 is left, heights as the heel strikes."""
    x, y, _ = walk[0 if side < 0 else 20].T
    chosen = (side * x > 0) & (np.abs(x) < 0.19) & (low < y) & (y < high)
    assert chosen.sum() >= 12
    return walk[:, chosen]


def part(walk, side: int, low: float, high: float) -> np.ndarray:
    """Path (F, 3) of the middle of such a slice."""
    return leg(walk, side, low, high).mean(axis=1)


def knee_angles(walk, side: int) -> np.ndarray:
    """Degrees by which a knee is bent, by frame."""
    hip, knee, ankle = (
        part(walk, side, 0.7, 0.85),
        part(walk, side, 0.4, 0.55),
        part(walk, side, 0.12, 0.25),
    )
    u, v = hip - knee, ankle - knee
    cosine = (u * v).sum(axis=1) / np.linalg.norm(u, axis=1) / np.linalg.norm(v, axis=1)
    return 180 - np.rad2deg(np.arccos(cosine))


def test_feet_alternate(walk):
    """One strikes in front as the other is behind; half a period later they have changed."""
    right, left = (part(walk, side, -1, 0.12) for side in (-1, 1))
    ahead = right[:, 2] - left[:, 2]
    assert ahead[0] > 0.4 and ahead[20] < -0.4
    changes = np.flatnonzero(np.sign(ahead) != np.sign(np.roll(ahead, 1)))
    assert len(changes) == 2 and abs(changes[1] - changes[0] - 20) <= 2
    np.testing.assert_allclose(left, np.roll(right, 20, axis=0) * (-1, 1, 1), atol=0.05)


def test_a_foot_stands_as_the_other_swings_forward(walk):
    """It goes back as it stands, which moves the person forward, and is lifted as it swings."""
    for side in (-1, 1):
        foot = part(walk, side, -1, 0.12)
        forward = np.roll(foot[:, 2], -1) - np.roll(foot[:, 2], 1)
        standing = leg(walk, side, -1, 0.12)[..., 1].min(axis=1) < 0.02
        assert 0.3 < standing.mean() < 0.75
        assert (forward[standing] < 0).mean() > 0.85
        assert forward[~standing].max() > -2 * forward[standing].mean() * 0.8
        assert np.ptp(foot[:, 1]) > 0.08


def test_soles_are_on_the_ground(walk):
    lowest = walk[:, :, 1].min(axis=1)
    assert np.abs(lowest).max() < 0.03


def test_knees_bend(walk):
    """Most as the leg swings, little as it bears the body, each in its own half of the period."""
    right, left = knee_angles(walk, -1), knee_angles(walk, 1)
    for knee in (right, left):
        assert 40 < knee.max() < 75 and knee.min() < 15
    assert 24 <= right.argmax() <= 32 and 4 <= left.argmax() <= 12
    shin, knee = part(walk, -1, 0.12, 0.25), part(walk, -1, 0.4, 0.55)
    swing = right.argmax()
    assert shin[swing, 2] < knee[swing, 2]  # it bends backwards


@pytest.mark.parametrize("frames", [1, 7, 24])
def test_the_period_closes(frames):
    scene = load_scene("walker:600", period=frames)
    assert scene.frames == frames
    np.testing.assert_allclose(scene.pose(frames), scene.pose(0), atol=1e-9)


def test_motion_is_smooth(walk):
    steps = np.linalg.norm(np.roll(walk, -1, axis=0) - walk, axis=-1)
    assert 0.02 < steps.max() < 0.2 and steps.max(axis=1).min() > 0.01
