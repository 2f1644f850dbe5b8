"""Common motion: what moves as one is one group, in all frames and not only in some."""

import numpy as np
import pytest

from sim.parts.analyse import analyse
from sim.parts.common import LEAST, MISSES
from sim.parts.divide import samples_of
from sim.parts.part import Kind
from tests.sim.parts.making import affine, ball, crumbs, plate, rigid, scene_of, with_noise

ERROR = 2.0**-18


def kinds(analysis) -> list[tuple[str, int]]:
    return [(str(part.kind), part.pieces) for part in analysis.parts]


def test_plates_on_one_bone_are_one_part(rng):
    """Twenty plates of an armour, apart from each other and flat, on each of three bones."""
    bones = [rigid(rng, 10) for _ in range(3)]
    things = [(plate(rng.uniform(-9, 9, 3)), bones[k % 3]) for k in range(60)]
    scene = scene_of(10, *things)
    analysis = analyse(scene)
    assert kinds(analysis) == [("structured", 20)] * 3
    for part, bone in zip(analysis.parts, bones, strict=True):
        for k, matrix in enumerate(part.transforms):
            rest = scene.pose(0)[part.vertices]
            np.testing.assert_allclose(rest @ matrix[:, :3].T + matrix[:, 3], bone(rest, k))


def test_affine_motions_of_all_kinds_at_once(rng):
    motions = [affine(rng, 12) for _ in range(4)]
    things = [(ball(rng.uniform(-5, 5, 3)), motions[k % 4]) for k in range(12)]
    analysis = analyse(scene_of(12, *things))
    assert kinds(analysis) == [("structured", 3)] * 4
    assert max(part.residual for part in analysis.parts) < 1e-12


def test_what_nearly_follows_does_not_pull_others_along(rng):
    """Of four balls one is off by thirty errors, in every frame but the first."""
    move = rigid(rng, 6)

    def off(points, frame):
        return move(points, frame) + 30 * ERROR * 16 * np.array([0, frame > 0, 0])

    things = [(ball((4 * k, 0, 0)), off if k == 1 else move) for k in range(4)]
    scene = scene_of(6, *things)
    assert 8 < half_size(scene) <= 16
    assert kinds(analyse(scene)) == [("structured", 3), ("structured", 1)]


def test_a_group_reaches_farther_the_larger_it_is(rng):
    """Small plates with some noise: the map of the first one says nothing about the last one."""
    noise = with_noise(lambda points, frame: points + 0.1 * frame, 1e-4, 7)
    things = []
    for k in range(8):
        points, faces = plate((0, 0, 0))
        things.append(((points + 3.0**k, faces), noise))
    scene = scene_of(9, *things)
    unit = 2.0 ** np.ceil(np.log2(half_size(scene)))
    assert kinds(analyse(scene, error=4e-4 / unit)) == [("structured", 8)]


@pytest.mark.parametrize("noise", [0.85, 1.15])
def test_noise_just_below_and_just_above_the_error(noise, rng):
    """In one frame that is not sampled: on each axis, so by the root of 3 from the map."""
    quiet, noisy = affine(rng, 40), affine(rng, 40)
    late = next(frame for frame in range(30, 40) if frame not in samples_of(range(40)))
    things = [(ball((0, 0, 0), 4000), noisy), (ball((4, 0, 0)), quiet)]
    unit = 2.0 ** np.ceil(np.log2(half_size(scene_of(40, *things))))
    size = noise * ERROR * unit / np.sqrt(3)

    def loud(points, frame):
        return with_noise(noisy, size, 3)(points, frame) if frame == late else noisy(points, frame)

    analysis = analyse(scene_of(40, (things[0][0], loud), things[1]), error=ERROR)
    expected = Kind.STRUCTURED if noise < 1 else Kind.CONTINUOUS
    assert [part.kind for part in analysis.parts] == [expected, Kind.STRUCTURED]
    assert analysis.parts[0].residual == pytest.approx(noise * ERROR, rel=0.1)


def half_size(scene) -> float:
    poses = np.stack([scene.pose(frame) for frame in range(scene.frames)])
    return float(np.ptp(poses, axis=(0, 1)).max() / 2)


def test_what_parts_between_the_samples_is_apart(rng):
    """Three balls move as one in every sampled frame, one of them elsewhere in two others."""
    common, own = rigid(rng, 60), rigid(rng, 60)
    between = [frame for frame in range(1, 60) if frame not in samples_of(range(60))][::20]
    assert len(between) > 1

    def strays(points, frame):
        return (own if frame in between else common)(points, frame)

    things = [(ball((x, 0, 0)), strays if x == 3 else common) for x in (0, 3, 6)]
    analysis = analyse(scene_of(60, *things))
    assert kinds(analysis) == [("structured", 2), ("structured", 1)]
    assert analysis.parts[1].faces.tolist() == list(range(64, 128))


def test_what_bends_between_the_samples_bends(rng):
    between = next(frame for frame in range(1, 60) if frame not in samples_of(range(60)))

    def stays(points, frame):
        return points**3 if frame == between else points + frame

    analysis = analyse(scene_of(60, (ball((0, 0, 0)), stays), (ball((9, 0, 0)), None)))
    assert kinds(analysis) == [("continuous", 1), ("static", 1)]


def test_crumbs_that_move_as_one_are_a_part(rng):
    """Single triangles: ones of a cloud are found, those that fly by themselves are not."""
    cloud = (crumbs(200, rng), rigid(rng, 9))
    strays = [(crumbs(1, rng), rigid(rng, 9)) for _ in range(600)]
    analysis = analyse(scene_of(9, *strays[:300], cloud, *strays[300:]))
    sizes = sorted((str(part.kind), part.pieces) for part in analysis.parts)
    assert sizes == [("structured", 200), ("unstructured", 600)]
    assert 600 > 2 * MISSES


def test_a_few_vertices_are_not_worth_an_instance(rng):
    """A triangle alone follows some map whatever it does, and two have six vertices."""
    move = rigid(rng, 5)
    few = crumbs(1, rng)
    assert 3 < LEAST <= 6
    assert kinds(analyse(scene_of(5, (few, move)))) == [("continuous", 1)]
    assert kinds(analyse(scene_of(5, (few, move), (crumbs(1, rng), move)))) == [("structured", 2)]


def test_float32_positions_are_exact_enough(rng):
    """Small things far apart from each other, in positions that were rounded to 24 bits."""
    move = rigid(rng, 12)
    things = [(plate(rng.uniform(-40, 40, 3)), move) for _ in range(30)]

    def rounded(motion):
        return lambda points, frame: motion(points, frame).astype(np.float32).astype(np.float64)

    analysis = analyse(scene_of(12, *((mesh, rounded(m)) for mesh, m in things)))
    assert kinds(analysis) == [("structured", 30)]
    assert 1e-9 < analysis.parts[0].residual < 1e-6
