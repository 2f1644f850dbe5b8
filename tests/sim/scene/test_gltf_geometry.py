"""sim.scene.gltf: which triangles a file holds, and where its nodes put them."""

import json

import numpy as np
import pytest

from sim.scene.load import load_scene
from tests.sim.scene.gltf_files import (
    BYTE,
    CORNERS,
    FLOAT,
    SHORT,
    UBYTE,
    UINT,
    USHORT,
    File,
    about,
    corners,
    pack,
    turned,
)

FIVE = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (0, 2, 1)]


def one_node(file: File, mesh: int, **more) -> File:
    file.add("nodes", mesh=mesh, **more)
    return file


def test_nodes_inherit_translation_rotation_and_scale(tmp_path):
    """P -> t + q (s p) q*, from the inside out; a matrix' columns come one after another."""
    file = File()
    mesh = file.mesh()
    outer, inner = about((1, 2, 2), 70), about((0, 1, -1), 200)
    file.add("nodes", children=[1], translation=[5, 6, 7], rotation=outer, scale=[2, 2, 0.5])
    file.add("nodes", children=[2], rotation=inner, translation=[-1, 0, 3], scale=[1, -3, 2])
    # a shear, which no rotation and scale are: x += 2 y, then + (10, 20, 30)
    file.add("nodes", mesh=mesh, matrix=[1, 0, 0, 0, 2, 1, 0, 0, 0, 0, 1, 0, 10, 20, 30, 1])
    expected = []
    for x, y, z in CORNERS:
        x, y, z = x + 2 * y + 10, y + 20, z + 30
        x, y, z = turned(inner, (x, -3 * y, 2 * z)) + (-1, 0, 3)
        expected.append(turned(outer, (2 * x, 2 * y, z / 2)) + (5, 6, 7))
    np.testing.assert_allclose(corners(file.load(tmp_path))[0], expected, rtol=1e-6)


def test_a_mesh_of_two_nodes_stands_twice(tmp_path):
    file = File()
    mesh = file.mesh()
    file.add("nodes", mesh=mesh, translation=[3, 0, 0])
    file.add("nodes", mesh=mesh, scale=[2, 2, 2])
    there = corners(file.load(tmp_path))
    np.testing.assert_array_equal(there, [np.add(CORNERS, (3, 0, 0)), np.multiply(CORNERS, 2)])


def test_only_the_default_scene_is_shown(tmp_path):
    file = File()
    mesh = file.mesh()
    file.add("nodes", mesh=mesh)
    file.add("nodes", children=[2])
    file.add("nodes", mesh=mesh, translation=[0, 0, 9])
    file.json |= {"scenes": [{"nodes": [0]}, {"nodes": [1]}], "scene": 1}
    np.testing.assert_array_equal(corners(file.load(tmp_path)), [np.add(CORNERS, (0, 0, 9))])
    del file.json["scene"]
    np.testing.assert_array_equal(corners(file.load(tmp_path)), [CORNERS])


@pytest.mark.parametrize(
    ("mode", "indices", "triangles"),
    [
        (None, [0, 1, 2, 2, 1, 3], [(0, 1, 2), (2, 1, 3)]),
        (4, [4, 0, 1, 2], [(4, 0, 1)]),
        (4, None, [(0, 1, 2)]),
        (5, [0, 1, 2, 3, 4], [(0, 1, 2), (1, 3, 2), (2, 3, 4)]),
        (5, None, [(0, 1, 2), (1, 3, 2), (2, 3, 4)]),
        (6, [4, 0, 1, 3, 2], [(4, 0, 1), (4, 1, 3), (4, 3, 2)]),
        (6, None, [(0, 1, 2), (0, 2, 3), (0, 3, 4)]),
    ],
)
@pytest.mark.parametrize("component", [UBYTE, USHORT, UINT])
def test_triangles_strips_and_fans(mode, indices, triangles, component, tmp_path):
    """A strip turns each second triangle round, which keeps its orientation."""
    file = File()
    mesh = file.mesh(FIVE, mode)
    if indices:
        entry = file.json["meshes"][mesh]["primitives"][0]
        entry["indices"] = file.accessor(indices, component)
    there = corners(one_node(file, mesh).load(tmp_path))

    def from_lowest(triangle):  # the specification leaves open where a triangle begins
        points = [tuple(point) for point in triangle]
        start = points.index(min(points))
        return points[start:] + points[:start]

    expected = [from_lowest([FIVE[k] for k in triangle]) for triangle in triangles]
    assert [from_lowest(t) for t in there.tolist()] == expected


def test_points_and_lines_are_left_out(tmp_path):
    file = File()
    mesh = file.mesh(FIVE, 0)
    for mode in (1, 2, 3, 4):
        part = {"attributes": {"POSITION": file.accessor(CORNERS)}, "mode": mode}
        file.json["meshes"][mesh]["primitives"].append(part)
    scene = one_node(file, mesh).load(tmp_path)
    assert scene.pose(0).tolist() == np.array(CORNERS, float).tolist()


def test_interleaved_positions(tmp_path):
    """byteStride: each position is followed by 8 bytes of something else; both offsets count."""
    file = File()
    rows = b"".join(pack([p], FLOAT) + b"\x7f" * 8 for p in CORNERS)
    view = file.view(b"\xff" * 4 + rows, byteStride=20)
    position = file.add(
        "accessors", bufferView=view, byteOffset=4, componentType=FLOAT, count=3, type="VEC3"
    )
    mesh = file.add("meshes", primitives=[{"attributes": {"POSITION": position}}])
    there = corners(one_node(file, mesh).load(tmp_path))
    np.testing.assert_array_equal(there, [CORNERS])


@pytest.mark.parametrize(
    ("component", "values", "meaning"),
    [
        (SHORT, [32767, -32768, -16384], [1, -1, -16384 / 32767]),
        (USHORT, [65535, 0, 13107], [1, 0, 0.2]),
        (BYTE, [127, -128, 0], [1, -1, 0]),
        (UBYTE, [255, 0, 51], [1, 0, 0.2]),
    ],
)
def test_normalised_integers(component, values, meaning, tmp_path):
    file = File()
    rows = [values, values[1:] + values[:1], values[2:] + values[:2]]
    position = file.accessor(rows, component, normalized=True)
    raw = file.accessor(rows, component)
    for accessor in (position, raw):
        mesh = file.add("meshes", primitives=[{"attributes": {"POSITION": accessor}}])
        file.add("nodes", mesh=mesh)
    there = corners(file.load(tmp_path))
    expected = [meaning, meaning[1:] + meaning[:1], meaning[2:] + meaning[:2]]
    np.testing.assert_allclose(there[0], expected, rtol=1e-15)
    np.testing.assert_array_equal(there[1], rows)


@pytest.mark.parametrize("base", [True, False], ids=["over a view", "over zeros"])
def test_sparse_accessor(base, tmp_path):
    file = File()
    sparse = {
        "count": 2,
        "indices": {"bufferView": file.view(pack([(1,), (4,)], USHORT)), "componentType": USHORT},
        "values": {"bufferView": file.view(pack([(7, 8, 9), (-1, -2, -3)], FLOAT))},
    }
    entry = {"componentType": FLOAT, "count": 5, "type": "VEC3", "sparse": sparse}
    if base:
        entry["bufferView"] = file.view(pack(FIVE, FLOAT))
    position = file.add("accessors", **entry)
    part = {"attributes": {"POSITION": position}, "mode": 6}
    there = corners(one_node(file, file.add("meshes", primitives=[part])).load(tmp_path))
    p = [FIVE[0], (7, 8, 9), FIVE[2], FIVE[3], (-1, -2, -3)]
    if not base:
        p = [(0, 0, 0) if k not in (1, 4) else p[k] for k in range(5)]
    np.testing.assert_array_equal(there, [(p[0], p[k], p[k + 1]) for k in (1, 2, 3)])


def test_buffers_inside_beside_and_in_a_glb_are_the_same(tmp_path):
    """A file beside is named by a URI, where a space is %20."""
    file = one_node(file := File(), file.mesh(FIVE, 5), translation=[1, 2, 3])
    inside = file.load(tmp_path)
    binary = load_scene(str(file.save_binary(tmp_path)))
    (tmp_path / "my data.bin").write_bytes(file.data)
    buffers = [{"byteLength": len(file.data), "uri": "my%20data.bin"}]
    (tmp_path / "b.gltf").write_text(json.dumps(file.json | {"buffers": buffers}))
    beside = load_scene(str(tmp_path / "b.gltf"))
    for scene in (binary, beside):
        np.testing.assert_array_equal(scene.faces, inside.faces)
        np.testing.assert_array_equal(scene.pose(0), inside.pose(0))


def test_names_may_be_any_unicode(tmp_path):
    file = one_node(file := File(), file.mesh(), name="Füchse 狐")
    text = json.dumps(json.loads(file.text()), ensure_ascii=False)
    (tmp_path / "u.gltf").write_bytes(text.encode())
    np.testing.assert_array_equal(corners(load_scene(str(tmp_path / "u.gltf"))), [CORNERS])


def test_a_rotation_of_any_length_is_a_rotation(tmp_path):
    quarter = np.array([0, 0, 0.5**0.5, 0.5**0.5])
    scenes = []
    for length in (1, 3):
        file = File()
        scenes.append(one_node(file, file.mesh(), rotation=(length * quarter).tolist()))
    one, three = (load_scene(str(file.save(tmp_path))).pose(0) for file in scenes)
    np.testing.assert_allclose(one, three, atol=1e-12)
    np.testing.assert_allclose(np.abs(one).max(), 2, atol=1e-12)
