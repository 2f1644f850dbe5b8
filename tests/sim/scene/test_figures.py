"""The built-in figures but the walker: sizes, shapes, motion and the errors of their names."""

import numpy as np
import pytest

from sim.errors import InputError
from sim.report.parts import parts
from sim.scene.builtin.figures import FIGURES
from sim.scene.load import load_scene
from tests.sim.scene.refusal import refusal

SMALLEST = {
    "burst": 6,
    "cloth": 2,
    "collapse": 6,
    "explosion": 6,
    "fleet": 300,
    "propeller": 100,
    "room": 300,
    "shock": 2,
    "walker": 428,
    "waves": 2,
}


def size(spec: str) -> int:
    return len(load_scene(spec, period=1).faces)


@pytest.mark.parametrize("name", SMALLEST)
def test_sizes_are_within_5_percent(name, rng):
    wanted = [1000, 1001, 1499, 2000, 3000, 20_000, 80_000]
    wanted += np.exp(rng.uniform(np.log(1000), np.log(20_000), 5)).astype(int).tolist()
    for triangles in wanted:
        assert abs(size(f"{name}:{triangles}") / triangles - 1) <= 0.05, triangles


@pytest.mark.parametrize("name", SMALLEST)
def test_the_smallest_size_works_and_one_less_names_it(name):
    smallest = SMALLEST[name]
    assert set(SMALLEST) == set(FIGURES)
    scene = load_scene(f"{name}:{smallest}")
    corners = np.stack([scene.pose(frame)[scene.faces] for frame in range(scene.frames)])
    areas = np.linalg.norm(np.cross(*np.diff(corners, axis=2).transpose(2, 0, 1, 3)), axis=-1)
    assert np.isfinite(corners).all()
    assert (areas.min(axis=1) > 0).all() or name == "collapse"
    for fewer in (smallest - 1, 0):
        line = f"^{name}:{fewer}: {fewer} triangles are too few; {smallest} is the smallest$"
        with pytest.raises(InputError, match=line):
            load_scene(f"{name}:{fewer}")


@pytest.mark.parametrize("name", SMALLEST)
def test_a_scene_is_a_function_of_name_size_and_frame(name):
    a, b = load_scene(f"{name}:2k"), load_scene(f"{name}:2000")
    assert (a.name, b.name, a.frames) == (f"{name}:2k", f"{name}:2000", 24)
    assert a.faces.dtype == np.int32 and a.pose(3).dtype == np.float64
    np.testing.assert_array_equal(a.faces, b.faces)
    late = a.pose(23)
    for frame in (23, 0, 7):  # in another order, and not for the first time
        np.testing.assert_array_equal(a.pose(frame), b.pose(frame))
    np.testing.assert_array_equal(a.pose(23), late)
    # with twice the frames every second one is the same
    np.testing.assert_allclose(load_scene(f"{name}:2k", period=48).pose(14), a.pose(7), atol=1e-12)


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("walker:", "'' is no size"),
        ("walker:many", "'many' is no size"),
        ("waves:-5", "'-5' is no size"),
        ("waves:1e4", "'1e4' is no size"),
        ("waves:10M1", "'10M1' is no size"),
        ("room:10.1M", "10100000 triangles are too many; 10000000 is the most"),
        pytest.param("burst:" + "9" * 400, "too many", id="astronomical"),
    ],
)
def test_bad_sizes(spec, words):
    assert words in refusal(spec)


@pytest.mark.parametrize("name", SMALLEST)
@pytest.mark.parametrize("frames", [0, -3])
def test_bad_frames(name, frames):
    with pytest.raises(InputError, match=f"^{name}: a period of {frames} frames; at least"):
        load_scene(name, period=frames)


def test_sizes_with_units():
    assert size("waves:20k") == size("waves") == size("waves:20000") == 20_000
    assert size("waves:1.25K") == size("waves:1250") and size("waves:0.01M") == size("waves:10k")


@pytest.mark.parametrize("triangles", [20_000, 80_000])
def test_a_hundredth_of_the_room_moves(triangles):
    scene = load_scene(f"room:{triangles}")
    rest = scene.pose(0)
    moves = np.any([(scene.pose(f) != rest).any(axis=1) for f in range(1, 24)], axis=0)
    corners = moves[scene.faces]
    assert (corners.any(axis=1) == corners.all(axis=1)).mean() > 0.999  # whole things move
    assert 0.008 <= corners.any(axis=1).mean() <= 0.012
    for frame in range(24):  # and stay in the room
        assert (scene.pose(frame) >= -1e-9).all()
        assert (scene.pose(frame) <= np.array([6, 3, 5]) + 1e-9).all()
    np.testing.assert_allclose(scene.pose(24), rest, atol=1e-9)


def test_waves_surface():
    """A height field, as no crest breaks: seen from above each triangle is turned up."""
    scene = load_scene("waves:5000")
    poses = np.stack([scene.pose(frame) for frame in range(24)])
    for pose in poses:
        a, b, c = np.moveaxis(pose[scene.faces], 1, 0)
        assert (np.cross(b - a, c - a)[:, 1] > 0).all()
    assert 0.05 < np.ptp(poses[..., 1]) < 0.3
    assert (np.ptp(poses, axis=0) > 0.01).all()  # every vertex circles
    steps = np.abs(np.diff(poses, axis=0)).max()
    assert steps < 0.05 and np.abs(scene.pose(24) - poses[0]).max() < 1e-9
    edges = np.concatenate([scene.faces[:, [0, 1]], scene.faces[:, [1, 2]], scene.faces[:, [2, 0]]])
    count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)[1]
    assert count.max() == 2 and (count == 1).sum() == 200  # a sheet of 50 x 50 cells


def test_burst_flies_apart():
    """A closed unit sphere, whose triangles keep their shape and share no vertex."""
    scene = load_scene("burst:3000")
    assert scene.faces.tolist() == np.arange(3 * len(scene.faces)).reshape(-1, 3).tolist()
    corners = np.stack([scene.pose(frame)[scene.faces] for frame in range(24)])
    np.testing.assert_allclose(np.linalg.norm(corners[0], axis=-1), 1, rtol=1e-12)
    a, b, c = np.moveaxis(corners[0], 1, 0)
    volume = np.einsum("ij,ij", a, np.cross(b, c)) / 6
    assert 0.98 < volume / (4 / 3 * np.pi) < 1  # closed, and turned outwards
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=2), axis=-1)
    np.testing.assert_allclose(sides, np.broadcast_to(sides[0], sides.shape), atol=1e-12)
    centres = corners.mean(axis=2)
    spread = np.linalg.norm(centres, axis=-1).mean(axis=1)
    assert (np.diff(spread) > 0).all() and spread[-1] > 1.5
    # who was next to a triangle is not any more
    apart = np.linalg.norm(np.diff(centres, axis=1), axis=-1)
    assert np.median(apart[-1]) > 10 * np.median(apart[0])
    turned = np.cross(*np.diff(corners[[0, 12]], axis=2).transpose(2, 0, 1, 3))
    turned /= np.linalg.norm(turned, axis=-1, keepdims=True)
    assert ((turned[0] * turned[1]).sum(axis=-1) < 0).mean() > 0.2  # they tumble


def test_fleet_is_one_ship_in_eight_places():
    """Each is rigid in every frame, moves, and is the first ship in one of two sizes."""
    scene = load_scene("fleet:80k")
    part = parts(scene.pose(0), scene.faces)
    numbers, counts = np.unique(part, return_counts=True)
    assert len(numbers) == 1 + 8 * 3 and len(set(counts[1:].tolist())) == 3
    rest = scene.pose(0)
    ships = np.unique(scene.faces[part > 0]).reshape(8, -1)
    sea = np.unique(scene.faces[part == 0])
    first = np.linalg.norm(rest[ships[0]] - rest[ships[0, 0]], axis=1)
    for frame in range(24):
        pose = scene.pose(frame)
        np.testing.assert_array_equal(pose[sea], rest[sea])
        for k, ship in enumerate(ships):
            lengths = np.linalg.norm(pose[ship] - pose[ship[0]], axis=1)
            np.testing.assert_allclose(lengths, first * (1, 0.6)[k % 2], atol=1e-12)
            assert frame == 0 or np.abs(pose[ship] - rest[ship]).max() > 0.1
