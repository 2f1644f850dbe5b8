"""Whole scenes: every verdict, what is shared, units, and scenes from files."""

from dataclasses import replace

import numpy as np
import pytest

from sim.errors import InputError
from sim.parts.analyse import analyse
from sim.parts.divide import samples_of
from sim.parts.part import Analysis, Kind
from sim.scene.load import load_scene
from sim.scene.normalise import normalise
from sim.scene.scene import Scene
from tests.sim.parts.making import affine, ball, bend, crumbs, plate, rigid, scene_of, shuffled


def check(scene: Scene, analysis: Analysis):
    """What holds of every analysis, from its definition."""
    parts = analysis.parts
    faces = np.sort(np.concatenate([part.faces for part in parts]))
    assert faces.tolist() == list(range(len(scene.faces)))
    assert [part.faces[0] for part in parts] == sorted(part.faces[0] for part in parts)
    vertices = np.concatenate([part.vertices for part in parts])
    assert len(np.unique(vertices)) == len(vertices)
    rest = scene.pose(analysis.frames[0])
    poses = [scene.pose(frame) for frame in analysis.frames]
    unit = 2.0 ** normalise(scene, analysis.frames).exponent
    for k, part in enumerate(parts):
        assert np.unique(scene.faces[part.faces]).tolist() == part.vertices.tolist()
        still = all((pose == rest)[part.vertices].all() for pose in poses)
        assert still == (part.kind is Kind.STATIC)
        assert (part.transforms is not None) == (part.kind is Kind.STRUCTURED)
        assert (part.fails_from is not None) == (part.kind is Kind.UNSTRUCTURED)
        assert (part.ratio is not None) == part.kind.deforms
        if part.transforms is None:
            assert part.shares is None
            continue
        source = part if part.shares is None else parts[part.shares]
        assert source.shares is None and (source is part or part.shares < k)
        assert part.residual <= analysis.error
        for matrix, pose in zip(part.transforms, poses, strict=True):
            moved = rest[source.vertices] @ matrix[:, :3].T + matrix[:, 3]
            missed = np.linalg.norm(moved - pose[part.vertices], axis=1).max() / unit
            assert missed <= part.residual + 1e-12
            assert np.linalg.cond(matrix[:, :3]) < 257


def test_one_part_of_each_kind(rng):
    shreds = [(crumbs(1, rng, 0.02), rigid(rng, 16)) for _ in range(300)]
    scene = scene_of(
        16,
        (plate((0, -3, 0), 9), None),
        (ball((0, 0, 0)), rigid(rng, 16)),
        (plate((5, 0, 0), 9), bend),
        (ball((9, 9, 9)), None),
        *shreds,
    )
    analysis = analyse(scene)
    check(scene, analysis)
    found = [(str(part.kind), part.pieces) for part in analysis.parts]
    assert found == [("static", 2), ("structured", 1), ("continuous", 1), ("unstructured", 300)]
    assert analysis.parts[2].ratio < 2 < analysis.parts[3].ratio
    assert 0 < analysis.parts[3].fails_from < 16


def test_what_bends_and_moves_apart_is_one_part():
    """Each tile has a tree that serves it; all of them together have not."""
    scene = shuffled(64)
    analysis = analyse(scene)
    (part,) = analysis.parts
    assert part.kind is Kind.UNSTRUCTURED and part.pieces == 64
    assert len(part.faces) == len(scene.faces) and part.ratio > analysis.factor
    assert part.fails_from == 1 and part.residual > 0.1
    assert len(analyse(scene, factor=100).parts) == 64


def test_the_same_geometry_in_other_places_is_shared(rng):
    """Placed by affine maps, other meshes between them, and one whose triangles go round wrong."""
    points, faces = ball((0, 0, 0))
    places = [affine(rng, 2) for _ in range(4)]
    copies = [((place(points, 1), faces), affine(rng, 7)) for place in places]
    odd = points[:, ::-1] ** 3
    others = [((place(odd, 1), faces), affine(rng, 7)) for place in places[:2]]
    turned = ((points + 3, faces[:, [1, 2, 0]]), affine(rng, 7))
    scene = scene_of(7, copies[0], others[0], copies[1], turned, others[1], *copies[2:])
    analysis = analyse(scene)
    check(scene, analysis)
    assert [part.kind for part in analysis.parts] == [Kind.STRUCTURED] * 7
    assert [part.shares for part in analysis.parts] == [None, None, 0, None, 1, 0, 0]


@pytest.mark.parametrize(("noise", "shares"), [(0.4, 0), (0.8, None)])
def test_a_copy_is_held_to_the_error_in_all_frames(noise, shares, rng):
    """Against the first one it is off by as much at rest as it is off by itself later."""
    (points, faces), error = ball((0, 0, 0), 1000), 1e-4
    off = noise * error * rng.choice([-1.0, 1.0], points.shape) / np.sqrt(3)
    place, move = 2 * np.ones(3), rigid(rng, 9)

    def drifts(rest, frame):
        return rest + 0.1 * frame + off * (frame > 0)

    scene = scene_of(9, ((points, faces), move), ((points + off + place, faces), drifts))
    unit = 2.0 ** normalise(scene).exponent
    analysis = analyse(scene, error=error / unit)
    check(scene, analysis)
    assert [part.kind for part in analysis.parts] == [Kind.STRUCTURED] * 2
    assert analysis.parts[1].shares == shares


def test_nothing_depends_on_units(rng):
    """Far from the origin and large, or tiny: the same parts, and transforms in these units."""
    scene = scene_of(9, (ball((0, 0, 0)), affine(rng, 9)), (plate((4, 0, 0)), bend))
    plain = analyse(scene)
    for scale, shift in ((2.0**40, 0.0), (2.0**-40, 0.0), (1e3, 5e6)):
        moved = replace(scene, pose=lambda k, s=scale, t=shift: scene.pose(k) * s + t)
        analysis = analyse(moved)
        check(moved, analysis)
        assert [part.kind for part in analysis.parts] == [part.kind for part in plain.parts]
        linear = analysis.parts[0].transforms[:, :, :3]
        np.testing.assert_allclose(linear, plain.parts[0].transforms[:, :, :3], atol=1e-5)


def test_frames_that_are_asked_for(rng):
    """What happens in others does not count, and rest is the first of them."""

    def late(points, frame):
        return points + max(frame - 5, 0) * points**2

    scene = scene_of(9, (ball((0, 0, 0)), late), (plate((4, 0, 0)), rigid(rng, 9)))
    for frames, kinds in (
        (range(0, 1), ["static"]),
        (range(1, 6), ["static", "structured"]),
        (range(5, 7), ["continuous", "structured"]),
        (None, ["continuous", "structured"]),
    ):
        analysis = analyse(scene, frames)
        check(scene, analysis)
        assert [str(part.kind) for part in analysis.parts] == kinds


def test_what_falls_into_a_point_or_a_plane_deforms():
    for flat in ((0, 0, 0), (1, 0, 1)):
        things = ball((0, 0, 0)), lambda points, k, flat=flat: points * (flat if k == 2 else 1 + k)
        (part,) = analyse(scene_of(5, things)).parts
        assert part.kind is Kind.CONTINUOUS and part.residual < 1e-12


def test_what_vanishes_between_the_samples_deforms():
    between = next(frame for frame in range(1, 60) if frame not in samples_of(range(60)))
    motion = ball((0, 0, 0)), lambda points, k: points * (0 if k == between else 1 + k)
    assert [part.kind for part in analyse(scene_of(60, motion)).parts] == [Kind.CONTINUOUS]


REAL = {
    "CornellBox.glb": [("static", 4, 36)],
    "Fox.glb": [("continuous", 1, 576)],
    "elephant.npz": [("continuous", 1, 12064)],
    "MorphStressTest.gltf": [("static", 1, 12)] + 8 * [("continuous", 1, 300)],
}


@pytest.mark.parametrize("name", REAL)
def test_real_scenes(name, scene_file):
    scene = load_scene(str(scene_file(name)))
    analysis = analyse(scene)
    check(scene, analysis)
    found = [(str(part.kind), part.pieces, len(part.faces)) for part in analysis.parts]
    assert found == REAL[name]


BUILT_IN = {
    "walker:2000": ["continuous"],
    "waves:2000": ["continuous"],
    "cloth:500": ["continuous"],
    "shock:2000": ["continuous"],
    "collapse:2000": ["continuous"],
    "room:4000": ["static", "structured", "structured", "continuous"],
    "propeller:2000": ["structured", "continuous", "structured"],
    "fleet:4000": ["static"] + 8 * ["structured"],
    "burst:2000": ["unstructured"],
}


@pytest.mark.parametrize("name", BUILT_IN)
def test_built_in_scenes(name):
    scene = load_scene(name)
    analysis = analyse(scene)
    check(scene, analysis)
    assert [str(part.kind) for part in analysis.parts] == BUILT_IN[name]
    again = analyse(load_scene(name))
    for part, other in zip(analysis.parts, again.parts, strict=True):
        np.testing.assert_equal(vars(part), vars(other))


def test_an_explosion_is_many_things_that_fly():
    scene = load_scene("explosion:20000")
    analysis = analyse(scene)
    check(scene, analysis)
    assert {part.kind for part in analysis.parts} == {Kind.STRUCTURED}
    assert 100 < len(analysis.parts) < 190
    assert max(part.pieces for part in analysis.parts) > 10  # the slowest ones are as one


def test_a_fleet_shares_one_ship():
    shares = [part.shares for part in analyse(load_scene("fleet:80k")).parts]
    assert shares == [None, None] + 7 * [1]


@pytest.mark.parametrize(
    ("options", "words"),
    [({"error": -1e-9}, "error of -1e-09"), ({"error": np.nan}, "error of nan")]
    + [({"factor": 0.9}, "factor of 0.9"), ({"factor": np.inf}, "factor of inf")],
)
def test_options_that_are_none(options, words):
    with pytest.raises(ValueError, match=words):
        analyse(scene_of(1, (ball((0, 0, 0)), None)), **options)


def test_frames_that_are_none():
    with pytest.raises(InputError, match="has no frame 3; frames are 0 to 2"):
        analyse(scene_of(3, (ball((0, 0, 0)), None)), range(1, 4))
