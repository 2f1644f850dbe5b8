"""Mesh files, numbered sequences of them, and what load_scene refuses."""

import re

import numpy as np
import pytest
import trimesh

from sim.errors import InputError
from sim.scene.load import load_scene
from tests.sim.scene.refusal import refusal

FACES = np.array([[0, 1, 2], [2, 1, 3]], np.int32)
POINTS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.5]])
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 {}\n{}"


def corners(scene, frame=0):
    return scene.pose(frame)[scene.faces]


def obj(path, faces="f 1 2 3\nf 3 2 4\n", z=0.5):
    path.write_text(OBJ.format(z, faces))
    return path


def test_obj_with_quads_and_seams(tmp_path):
    """A quad is two triangles that cover it; vertices split by normals are one again."""
    faces = "vn 0 0 1\nvn 1 0 0\nf 1//1 2//1 4//1 3//1\nf 1//2 2//2 4//2\n"
    scene = load_scene(str(obj(tmp_path / "q.obj", faces, 0)))
    assert scene.frames == 1 and scene.faces.shape == (3, 3)
    assert sorted(map(tuple, scene.pose(0))) == sorted([(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)])
    a, b, c = np.moveaxis(corners(scene), 1, 0)
    np.testing.assert_array_equal(np.cross(b - a, c - a) / 2, [[0, 0, 0.5]] * 3)
    edges = {
        tuple(sorted(e))
        for t in scene.faces[:2].tolist()
        for e in zip(t, t[1:] + t[:1], strict=True)
    }
    assert len(edges) == 5


@pytest.mark.parametrize("suffix", ["ply", "off", "stl", "obj", "PLY"])
def test_mesh_formats(suffix, tmp_path):
    """STL has three vertices a triangle: merged, a box has eight again."""
    box = trimesh.creation.box((1, 2, 4))
    path = tmp_path / f"box.{suffix}"
    path.write_bytes(_exported(box, suffix.lower()))
    scene = load_scene(str(path))
    assert scene.pose(0).shape == (8, 3) and scene.faces.shape == (12, 3) and scene.frames == 1
    np.testing.assert_array_equal(corners(scene), box.triangles)


def _exported(mesh, suffix) -> bytes:
    data = mesh.export(file_type=suffix)
    return data if isinstance(data, bytes) else data.encode()


def test_bad_mesh_files(tmp_path):
    (tmp_path / "points.obj").write_text(OBJ.format(0, ""))
    (tmp_path / "points.ply").write_text(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
        "property float z\nend_header\n0 0 0\n"
    )
    obj(tmp_path / "beyond.obj", "f 1 2 9\n")
    (tmp_path / "nan.off").write_text("OFF\n3 1 0\n0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n")
    for name in ("a.ply", "a.off", "a.stl", "a.obj"):
        (tmp_path / name).write_bytes(b"\x89nothing of the sort\n" * 9)
    for name in ("points.obj", "points.ply", "beyond.obj", "a.ply", "a.off", "a.stl", "a.obj"):
        refusal(tmp_path / name)
    assert "frame 0, vertex 2 is NaN" in refusal(tmp_path / "nan.off")


@pytest.mark.parametrize("names", [["w1", "w2", "w10"], ["a9_01", "a10_00", "a10_1"], ["one"]])
def test_sequences_are_in_natural_order(names, tmp_path):
    for frame, name in enumerate(names):
        obj(tmp_path / f"{name}.obj", z=frame)
    (tmp_path / "notes.txt").write_text("1")
    (tmp_path / "w3.obj.bak").write_text("no mesh")
    (tmp_path / "w4").mkdir()
    for spec in (tmp_path, tmp_path / "*.obj", tmp_path / f"{names[0][0]}*"):
        scene = load_scene(str(spec))
        assert (scene.name, scene.frames) == (spec.name, len(names))
        assert [scene.pose(frame)[3, 2] for frame in range(len(names))] == list(range(len(names)))


def test_a_pattern_over_folders_counts_the_folders(tmp_path):
    for frame in (9, 10, 100):
        (tmp_path / f"t{frame}").mkdir()
        obj(tmp_path / f"t{frame}" / "mesh.obj", z=frame)
    scene = load_scene(str(tmp_path / "t*" / "mesh.obj"))
    assert [scene.pose(frame)[3, 2] for frame in range(3)] == [9, 10, 100]


def test_a_file_with_a_bracket_in_its_name_is_that_file(tmp_path):
    obj(tmp_path / "a.obj", z=1)
    assert load_scene(str(obj(tmp_path / "[a].obj", z=7))).pose(0)[3, 2] == 7


@pytest.mark.parametrize(
    ("faces", "words"),
    [
        ("f 1 2 3\n", "has 1 triangles, but w1.obj has 2"),
        ("f 1 2 3\nf 3 4 2\n", "triangle 1 joins vertices"),
        ("f 1 2 3\nf 3 2 1\n", "has 3 vertices, but w1.obj has 4"),
    ],
)
def test_a_different_topology_names_the_file(faces, words, tmp_path):
    obj(tmp_path / "w1.obj")
    obj(tmp_path / "w2.obj")
    obj(tmp_path / "w10.obj", faces)
    with pytest.raises(InputError, match=f"^{re.escape(str(tmp_path / 'w10.obj'))}: .*$") as error:
        load_scene(str(tmp_path))
    assert words in str(error.value) and "same triangles" in str(error.value)


def test_a_different_number_of_vertices(tmp_path):
    for name, count in (("w1.off", 3), ("w2.off", 4)):
        rows = "".join(f"{k} {k * k} 0\n" for k in range(count))
        (tmp_path / name).write_text(f"OFF\n{count} 1 0\n{rows}3 0 1 2\n")
    with pytest.raises(InputError, match="w2.off: has 4 vertices, but w1.off has 3"):
        load_scene(str(tmp_path))


def test_bad_sequences(tmp_path):
    assert "the folder holds no numbered mesh file" in refusal(tmp_path)
    assert "the pattern matches no numbered mesh file" in refusal(tmp_path / "*.obj")
    for name in ("a1", "a2", "b1"):
        obj(tmp_path / f"{name}.obj")
    assert "more than one sequence (a#.obj, b#.obj)" in refusal(tmp_path)
    assert load_scene(str(tmp_path / "a*.obj")).frames == 2
    (tmp_path / "a2.obj").write_text(OBJ.format("nan", "f 1 2 3\nf 3 2 4\n"))
    with pytest.raises(InputError, match=r"^a\*\.obj: frame 1, vertex 3 is NaN"):
        load_scene(str(tmp_path / "a*.obj"))


@pytest.mark.parametrize("name", ["none.npz", "none.glb", "none.obj", "none", "", "walkers:80"])
def test_missing_files(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if name:
        assert "no such file, folder or built-in figure" in refusal(name)


def test_unknown_files_name_those_that_are_known(tmp_path):
    (tmp_path / "a.blend").write_text("")
    line = refusal(tmp_path / "a.blend")
    assert all(s in line for s in ("'.blend'", ".npz", ".glb", ".gltf", ".obj", ".ply", ".stl"))


def test_options_of_other_scenes_are_refused(tmp_path):
    np.savez(tmp_path / "c.npz", faces=FACES, vertices=POINTS)
    obj(tmp_path / "a1.obj")
    (tmp_path / "g.glb").write_bytes(b"")
    for name in ("c.npz", "a1.obj", "."):
        for option, value in (("fps", 24.0), ("animation", "walk"), ("animation", "")):
            with pytest.raises(InputError, match=f"{option} is for glTF files"):
                load_scene(str(tmp_path / name), **{option: value})
    for name in ("c.npz", "a1.obj", ".", "g.glb"):
        with pytest.raises(InputError, match="period is for built-in figures"):
            load_scene(str(tmp_path / name), period=24)
    for option, value in (("fps", 24.0), ("animation", "walk")):
        with pytest.raises(InputError, match=f"walker: {option} is for glTF files"):
            load_scene("walker", **{option: value})
