"""Vertex caches."""

import numpy as np
import pytest

from sim.scene.load import load_scene
from tests.sim.scene.refusal import refusal

FACES = np.array([[0, 1, 2], [2, 1, 3]], np.int32)
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]])
MOTION = np.stack([POINTS + k for k in range(3)])


@pytest.mark.parametrize("kind", [np.float16, np.float32, np.float64, np.int8, np.uint32])
@pytest.mark.parametrize("index", [np.uint8, np.int64, np.uint64])
def test_cache(kind, index, tmp_path):
    file = tmp_path / "c.npz"
    np.savez_compressed(file, faces=FACES.astype(index), vertices=MOTION.astype(kind), extra=1)
    scene = load_scene(str(file))
    assert (scene.name, scene.frames, scene.faces.dtype) == ("c.npz", 3, np.int32)
    np.testing.assert_array_equal(scene.faces, FACES)
    for frame in range(3):
        assert scene.pose(frame).dtype == np.float64
        np.testing.assert_array_equal(scene.pose(frame), MOTION.astype(kind)[frame])
    scene.pose(1)[:] = 7  # a pose is the caller's
    np.testing.assert_array_equal(scene.pose(1), MOTION.astype(kind)[1])


def test_cache_of_one_frame(tmp_path):
    np.savez(tmp_path / "c.npz", faces=FACES, vertices=POINTS)
    scene = load_scene(str(tmp_path / "c.npz"))
    assert scene.frames == 1
    np.testing.assert_array_equal(scene.pose(0)[scene.faces], POINTS[FACES])


ODD = MOTION.copy()
ODD[2, 3, 1] = np.nan
BAD_CACHES = {
    "no faces": ({"vertices": MOTION}, "no array 'faces' (it holds vertices)"),
    "no vertices": ({"faces": FACES, "x": 1}, "no array 'vertices' (it holds faces, x)"),
    "nothing": ({}, "it holds nothing"),
    "flat": ({"faces": FACES, "vertices": POINTS[0]}, "float64 of shape (3,)"),
    "plane": ({"faces": FACES, "vertices": POINTS[:, :2]}, "float64 of shape (4, 2)"),
    "complex": ({"faces": FACES, "vertices": POINTS * 1j}, "complex128 of shape (4, 3)"),
    "words": ({"faces": FACES, "vertices": POINTS.astype(str)}, "of shape (4, 3)"),
    "no frame": ({"faces": FACES, "vertices": MOTION[:0]}, "hold no frame"),
    "no vertex": ({"faces": FACES, "vertices": MOTION[:, :0]}, "there are 0 vertices"),
    "no triangle": ({"faces": FACES[:0], "vertices": MOTION}, "has no triangles"),
    "quads": ({"faces": [[0, 1, 3, 2]], "vertices": MOTION}, "int64 of shape (1, 4)"),
    "flat faces": ({"faces": [0, 1, 2], "vertices": MOTION}, "int64 of shape (3,)"),
    "float faces": ({"faces": FACES * 1.0, "vertices": MOTION}, "float64 of shape (2, 3)"),
    "bool faces": ({"faces": FACES > 0, "vertices": MOTION}, "bool of shape (2, 3)"),
    "beyond": ({"faces": FACES + 1, "vertices": MOTION}, "triangle 1 uses vertex 4"),
    "negative": ({"faces": FACES - 1, "vertices": MOTION}, "triangle 0 uses vertex -1"),
    "huge": ({"faces": FACES + np.int64(2**32), "vertices": MOTION}, f"vertex {2**32}"),
    "NaN": ({"faces": FACES, "vertices": ODD}, "frame 2, vertex 3 is NaN"),
    "objects": ({"faces": FACES, "vertices": np.array([None])}, "cannot be read"),
}


@pytest.mark.parametrize("case", BAD_CACHES)
def test_bad_caches(case, tmp_path):
    arrays, words = BAD_CACHES[case]
    np.savez(tmp_path / "c.npz", **arrays)
    assert words in refusal(tmp_path / "c.npz")


def test_other_files_called_npz(tmp_path):
    with (tmp_path / "a.npz").open("wb") as file:
        np.save(file, POINTS)
    (tmp_path / "b.npz").write_text("v 0 0 0\nv 1 1 1\n")
    (tmp_path / "c.npz").write_bytes(b"")
    np.savez(tmp_path / "d.npz", faces=FACES, vertices=MOTION)
    (tmp_path / "d.npz").write_bytes((tmp_path / "d.npz").read_bytes()[:-9])
    for name in "abcd":
        assert "is no .npz file, or one cut short" in refusal(tmp_path / f"{name}.npz")
