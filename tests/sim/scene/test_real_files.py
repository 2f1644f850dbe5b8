"""Real files: counts known from elsewhere, rest poses as trimesh reads them."""

import numpy as np
import pytest
import trimesh

from sim.errors import InputError
from sim.scene.load import load_scene


def brute_distinct(scene) -> int:
    """How many of a scene's vertices differ in some frame."""
    poses = np.stack([scene.pose(frame) for frame in range(scene.frames)], axis=1) + 0.0
    return len({row.tobytes() for row in poses})


def test_fox(scene_file):
    """576 triangles of 1728 vertices that share no index; three animations."""
    path = str(scene_file("Fox.glb"))
    scenes = {name: load_scene(path, animation=name) for name in ("Survey", "Walk", "Run")}
    for number, scene in enumerate(scenes.values()):
        assert scene.faces.shape == (576, 3) and scene.faces.dtype == np.int32
        again = load_scene(path, animation=str(number))
        assert again.frames == scene.frames
        np.testing.assert_array_equal(again.pose(scene.frames - 1), scene.pose(scene.frames - 1))
        assert len(scene.pose(0)) == brute_distinct(scene) < 400
        # as glTF has no other way, this fox is some 150 units long at every time
        for frame in (0, scene.frames // 2, scene.frames - 1):
            assert 100 < np.ptp(scene.pose(frame), axis=0).max() < 200
    assert load_scene(path).frames == scenes["Survey"].frames == int(3.41667 * 24) + 1
    assert len({scene.frames for scene in scenes.values()}) == 3
    with pytest.raises(InputError, match="0 'Survey', 1 'Walk', 2 'Run'"):
        load_scene(path, animation="Sit")


def test_fox_walks_in_a_circle(scene_file):
    """The first moment of Walk and Run is their last one: skin and slerp close the loop."""
    for name in ("Walk", "Run"):
        scene = load_scene(str(scene_file("Fox.glb")), animation=name, fps=60)
        poses = [scene.pose(frame) for frame in range(scene.frames)]
        step = max(np.abs(b - a).max() for a, b in zip(poses, poses[1:], strict=False))
        assert np.abs(poses[-1] - poses[0]).max() < 2 * step < 20


def test_cornell_box_stands_where_trimesh_puts_it(scene_file):
    path = scene_file("CornellBox.glb")
    scene = load_scene(str(path))
    other = trimesh.load_scene(str(path), process=False)
    assert scene.frames == 1
    np.testing.assert_allclose(
        [scene.pose(0).min(axis=0), scene.pose(0).max(axis=0)], other.bounds, rtol=1e-6, atol=1e-6
    )
    mesh = other.to_mesh()
    assert len(scene.faces) == len(mesh.faces)

    def ordered(corners):
        return np.array(sorted(np.round(corners.mean(axis=1), 4).tolist()))

    np.testing.assert_allclose(
        ordered(scene.pose(0)[scene.faces]), ordered(mesh.triangles), atol=2e-4
    )
    assert len(scene.pose(0)) == brute_distinct(scene)


def test_morph_stress_test(scene_file):
    """Eight targets, one after another; the base under them does not move."""
    scene = load_scene(str(scene_file("MorphStressTest.gltf")))
    poses = [scene.pose(frame) for frame in range(0, scene.frames, 8)]
    moved = np.any([pose != poses[0] for pose in poses], axis=(0, 2))
    assert 0.1 < moved.mean() < 1
    assert len(scene.pose(0)) == brute_distinct(scene)
    mesh = trimesh.load_scene(str(scene_file("MorphStressTest.gltf")), process=False).to_mesh()
    assert len(scene.faces) == len(mesh.faces)


def test_elephant(scene_file):
    path = scene_file("elephant.npz")
    scene = load_scene(str(path))
    with np.load(path) as arrays:
        faces, vertices = arrays["faces"], arrays["vertices"]
    assert scene.frames == len(vertices)
    for frame in (0, scene.frames // 2, scene.frames - 1):
        np.testing.assert_array_equal(scene.pose(frame)[scene.faces], vertices[frame][faces])
