"""sim.scene.gltf: what is wrong with a file is one line that names it."""

import json
import struct

import pytest

from tests.sim.scene.gltf_files import File
from tests.sim.scene.refusal import refusal


def whole() -> File:
    file = File()
    file.add("nodes", mesh=file.mesh())
    file.animation(0, "translation", [0, 1], [(0, 0, 0), (1, 1, 1)], name="hop")
    file.animation(0, "scale", [0, 1], [(1, 1, 1), (2, 2, 2)])
    return file


@pytest.mark.parametrize("name", ["KHR_draco_mesh_compression", "EXT_meshopt_compression"])
def test_compressed_files(name, tmp_path):
    file = whole()
    file.json["extensionsRequired"] = ["KHR_texture_transform", name]
    line = refusal(file.save(tmp_path))
    assert name in line and "uncompressed" in line


@pytest.mark.parametrize("wanted", ["jump", "2", "-1", "HOP", "1.0"])
def test_a_wrong_animation_lists_those_that_exist(wanted, tmp_path):
    line = refusal(whole().save(tmp_path), animation=wanted)
    assert f"no animation {wanted!r}" in line and line.endswith("it has: 0 'hop', 1 ''")


def test_an_animation_of_a_file_that_has_none(tmp_path):
    file = whole()
    del file.json["animations"]
    assert refusal(file.save(tmp_path), animation="0").endswith("it has: none")


@pytest.mark.parametrize("fps", [0, -24, float("nan"), float("inf")])
def test_fps(fps, tmp_path):
    assert f"fps is {fps}" in refusal(whole().save(tmp_path), fps=fps)


def test_a_glb_cut_short_anywhere(tmp_path):
    data = whole().save_binary(tmp_path).read_bytes()
    for size in range(0, len(data), 7):
        (tmp_path / "cut.glb").write_bytes(data[:size])
        assert "damaged or cut short" in refusal(tmp_path / "cut.glb")


def test_a_gltf_cut_short_anywhere(tmp_path):
    data = whole().text().encode()
    for size in range(0, len(data), 31):
        (tmp_path / "cut.gltf").write_bytes(data[:size])
        assert "damaged or cut short" in refusal(tmp_path / "cut.gltf")


def test_a_missing_buffer_is_named(tmp_path):
    buffers = [{"byteLength": 1, "uri": "gone.bin"}]
    (tmp_path / "b.gltf").write_text(json.dumps(whole().json | {"buffers": buffers}))
    assert "gone.bin" in refusal(tmp_path / "b.gltf")


def test_a_short_buffer(tmp_path):
    file = whole()
    (tmp_path / "short.bin").write_bytes(file.data[:-1])
    buffers = [{"byteLength": len(file.data), "uri": "short.bin"}]
    (tmp_path / "b.gltf").write_text(json.dumps(file.json | {"buffers": buffers}))
    refusal(tmp_path / "b.gltf")


def test_no_triangles(tmp_path):
    for mode in (0, 1, 2, 3):
        file = File()
        file.add("nodes", mesh=file.mesh(mode=mode))
        assert "has no triangles" in refusal(file.save(tmp_path))
    file = File()
    file.mesh()  # no node shows it
    assert "has no triangles" in refusal(file.save(tmp_path))


def test_an_index_beyond_the_vertices(tmp_path):
    file = whole()
    file.json["meshes"][0]["primitives"][0]["indices"] = file.accessor([0, 1, 3], 5121)
    assert "triangle 0 uses vertex 3" in refusal(file.save(tmp_path))


@pytest.mark.parametrize(
    "nodes",
    [
        [{"mesh": 0, "children": [0]}],
        [{"mesh": 0, "children": [1]}, {"children": [0]}],
        [{"mesh": 0, "children": [1]}, {"children": [2]}, {"children": [1]}],
        [{"children": [2]}, {"children": [2]}, {"mesh": 0}],
    ],
)
@pytest.mark.parametrize("scenes", [None, [{"nodes": [0]}]])
def test_nodes_that_are_no_tree(nodes, scenes, tmp_path):
    file = whole()
    file.json["nodes"] = nodes
    if scenes:
        file.json["scenes"] = scenes
    assert "its own ancestor, or has two parents" in refusal(file.save(tmp_path))


@pytest.mark.parametrize(
    "broken",
    [
        lambda j: j["meshes"][0]["primitives"][0]["attributes"].update(POSITION=99),
        lambda j: j["accessors"][0].update(componentType=4),
        lambda j: j["accessors"][0].update(count=100000),
        lambda j: j["accessors"][0].update(type="VEC2"),
        lambda j: j["animations"][0]["samplers"][0].update(output=0),
        lambda j: j["nodes"][0].update(mesh=1),
        lambda j: j.update(scene=3, scenes=[{"nodes": [0]}]),
        lambda j: j["bufferViews"][0].update(buffer=1),
    ],
)
def test_references_to_nothing(broken, tmp_path):
    file = whole()
    broken(file.json)
    refusal(file.save(tmp_path))


def test_not_a_number_names_frame_and_vertex(tmp_path):
    file = File()
    file.add("nodes", mesh=file.mesh())
    key = (0.0, float("nan"), 0.0)
    file.animation(0, "translation", [0, 0.5, 1], [(0, 0, 0), key, (0, 0, 0)], "STEP")
    assert "frame 1, vertex 0 is NaN" in refusal(file.save(tmp_path), fps=2)


@pytest.mark.parametrize("end", [float("inf"), float("nan"), 1e30, 42000])
def test_an_animation_without_an_end(end, tmp_path):
    file = File()
    file.add("nodes", mesh=file.mesh())
    file.animation(0, "translation", [0, end], [(0, 0, 0), (1, 1, 1)])
    refusal(file.save(tmp_path))


def test_garbage_that_calls_itself_glb(tmp_path):
    (tmp_path / "a.glb").write_bytes(struct.pack("<4sII", b"gltF", 2, 12))
    (tmp_path / "b.glb").write_bytes(struct.pack("<4sII", b"glTF", 2, 12))
    for name in ("a.glb", "b.glb"):
        refusal(tmp_path / name)


def test_a_compressed_buffer_view(tmp_path):
    file = whole()
    file.json["bufferViews"][0]["extensions"] = {"EXT_meshopt_compression": {"buffer": 0}}
    assert "EXT_meshopt_compression" in refusal(file.save(tmp_path))


def test_positions_that_an_extension_holds(tmp_path):
    file = whole()
    primitive = file.json["meshes"][0]["primitives"][0]
    del file.json["accessors"][primitive["attributes"]["POSITION"]]["bufferView"]
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    assert "KHR_draco_mesh_compression" in refusal(file.save(tmp_path))


def test_json_that_is_no_gltf(tmp_path):
    file = whole()
    del file.json["asset"]
    assert "no glTF" in refusal(file.save(tmp_path))


@pytest.mark.parametrize("times", [[0, 2, 1], [0, 1, 1]])
def test_keyframes_out_of_order(times, tmp_path):
    file = File()
    file.add("nodes", mesh=file.mesh())
    file.animation(0, "translation", times, [(0, 0, 0)] * 3)
    assert "order of time" in refusal(file.save(tmp_path))
