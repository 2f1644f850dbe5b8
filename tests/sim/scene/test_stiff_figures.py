"""The built-in figures whose parts move at rates that differ by many orders of magnitude."""

import numpy as np
import pytest

from sim.scene.builtin import cloth, propeller
from sim.scene.load import load_scene


def steps(scene, frame: int) -> np.ndarray:
    """How far each vertex moves from a frame to the next."""
    return np.linalg.norm(scene.pose(frame + 1) - scene.pose(frame), axis=1)


def test_propeller_turns_at_three_rates():
    scene = load_scene("propeller:3000", period=100_000)
    rest, later = scene.pose(0), scene.pose(1)
    count = len(propeller.blade(round(0.3 * 3000 / 4), 0)[0])
    radius = np.hypot(rest[:, 0], rest[:, 1])
    tip = int(radius[:count].argmax())

    def turned(a, b) -> float:
        return np.angle(np.exp(1j * (np.arctan2(b[1], b[0]) - np.arctan2(a[1], a[0]))))

    # 1009 turns of the blades in 100,000 frames; the hull turns too, about y
    assert turned(rest[tip], later[tip]) == pytest.approx(2 * np.pi * 1009e-5, rel=0.02)
    nose = rest[-1000:, 2]  # of the hull, which comes last
    hull = len(rest) - 1000 + int(nose.argmax())
    moved = np.linalg.norm(later[hull] - rest[hull])
    assert moved == pytest.approx(np.hypot(*rest[hull, ::2]) * 2 * np.pi * 1e-5, rel=1e-4)
    # the needle's end goes through its whole, small range in a few frames
    end = np.stack([scene.pose(frame)[rest[:, 2].argmin()] for frame in range(20)])
    assert 0.03 < np.ptp(end[:, 0]) < 0.05 and np.unique(end[:, 0]).size == 20


def test_cloth_rests_then_swings_and_does_not_stretch():
    scene = load_scene("cloth:2000", period=48)
    poses = np.stack([scene.pose(frame) for frame in range(48)])
    assert (poses[:17] == poses[0]).all() and (poses[17] != poses[0]).any()
    last, n = poses[-1].reshape(32 + 1, -1, 3), 31
    assert last.shape[1] == n + 1
    first = poses[0].reshape(last.shape)
    for corner in (0, n), (32, n):  # of z = 1: held
        there = poses.reshape(48, 33, n + 1, 3)[:, *corner]
        assert np.abs(there - first[corner]).max() < 1e-12
    assert last[0, 0, 1] < -0.5 and last[32, 0, 1] < -0.5  # those let go fell
    edges = np.linalg.norm(np.diff(poses.reshape(48, 33, n + 1, 3), axis=2), axis=-1) * n
    assert 0.99 < edges.sum(axis=2).mean() / n < 1.01  # lines of it keep their length


def test_cloth_is_at_rest_before_it_is_let_go():
    net, (points, speeds) = cloth.springs(), cloth.motion()
    force = net.force(points[0], speeds[0]) + cloth.WEIGHT
    assert np.abs(force[net.free]).max() < 0.03 * np.abs(cloth.WEIGHT).max()
    assert not speeds[: cloth.RELEASE + 1].any()


@pytest.mark.parametrize("frames", [24, 10_000])
def test_an_explicit_cloth_explodes_and_the_implicit_one_does_not(frames):
    net, (points, _) = cloth.springs(), cloth.motion()
    seconds, rng = cloth.SECONDS / frames, np.random.default_rng(2006)
    places = {"explicit": points[0] + 1e-9 * rng.normal(size=points[0].shape)}
    places["implicit"] = places["explicit"]
    speeds = dict.fromkeys(places, np.zeros_like(points[0]))
    for _ in range(60):
        force = net.force(places["explicit"], speeds["explicit"]) + cloth.WEIGHT
        speeds["explicit"] = speeds["explicit"] + seconds / net.mass * force * net.free[:, None]
        places["explicit"] = places["explicit"] + seconds * speeds["explicit"]
        places["implicit"], speeds["implicit"] = net.step(
            places["implicit"], speeds["implicit"], seconds, cloth.WEIGHT
        )
        assert np.abs(places["implicit"] - points[0]).max() < 0.01
        if np.abs(places["explicit"] - points[0]).max() > 1:
            return
    pytest.fail("the explicit cloth stays where it is")


def test_shock_is_still_before_its_front_and_calms_down_behind_it():
    scene = load_scene("shock:5000", period=10_000)
    rest, half = scene.pose(0), scene.pose(5000)
    assert (rest[:, 1] == 0).all()
    reached = half[:, 1] != 0
    distance = np.hypot(rest[:, 0], rest[:, 2])
    assert distance[reached].max() < distance[~reached].min() + 1e-12
    assert 0.7 < distance[reached].max() < 0.8  # sqrt(2) * 0.5 / 0.9 = 0.786
    moved = steps(scene, 9990)
    corner, far = distance.argmin(), distance.argmax()
    assert 1e-8 < moved[corner] < 1e-5 * moved.max() and moved[far] > 1e-3


def test_collapse_becomes_one_point_and_comes_back():
    scene = load_scene("collapse:3000", period=24)
    poses = np.stack([scene.pose(frame) for frame in range(24)])
    assert len(np.unique(poses[12], axis=0)) == 1
    assert all(len(np.unique(poses[f], axis=0)) == poses.shape[1] for f in range(24) if f != 12)
    np.testing.assert_array_equal(poses[5], poses[19])
    moved = steps(load_scene("collapse:3000", period=10_000), 4900)
    assert moved.max() > 1e3 * moved.min() > 0


def test_explosion_keeps_pieces_whole_and_spreads_their_speeds():
    scene = load_scene("explosion:5000", period=10_000)
    vertices = scene.faces.max() + 1
    label = np.arange(vertices)  # smallest vertex that triangles join each vertex to
    while True:
        low = label.copy()
        np.minimum.at(low, scene.faces, label[scene.faces].min(axis=1, keepdims=True))
        if (low == label).all():
            break
        label = low
    pieces = np.unique(label)
    assert 190 <= len(pieces) <= 210
    poses = scene.pose(0), scene.pose(9999)
    np.testing.assert_allclose(np.linalg.norm(poses[0], axis=1), 1, atol=1e-12)
    sides = [np.linalg.norm(np.diff(p[scene.faces], axis=1), axis=-1) for p in poses]
    np.testing.assert_allclose(*sides, atol=1e-12)  # triangles keep their shape
    moved = np.array([steps(scene, 0)[label == piece].mean() for piece in pieces])
    ratios = np.sort(np.log10(moved / moved.max()))
    assert ratios[0] < -5.5
    np.testing.assert_allclose(ratios, np.linspace(-6, 0, len(pieces)), atol=0.4)
