"""sim.scene.gltf: skins and morph targets, against sums written out."""

import numpy as np
import pytest

from tests.sim.scene.gltf_files import CORNERS, UBYTE, USHORT, File, about, corners

CLOSE = {"rtol": 0, "atol": 2e-6}  # the file's numbers are float32
FAR = 999.0  # tangents that nothing may use


def skinned(joints, weights, component=UBYTE, **more) -> File:
    """Node 0 shows the mesh with skin 0; nodes 1 and 2 are its joints, 2 within 1."""
    file = File()
    attributes = {}
    for number, (joint, weight) in enumerate(zip(joints, weights, strict=True)):
        attributes[f"JOINTS_{number}"] = file.accessor(joint, UBYTE)
        attributes[f"WEIGHTS_{number}"] = file.accessor(weight, component, normalized=True)
    file.add("nodes", mesh=file.mesh(**attributes), skin=0, translation=[50, 60, 70])
    file.add("nodes", children=[2], translation=[1, 0, 0])
    file.add("nodes", rotation=about((0, 0, 1), 90), translation=[0, 1, 0])
    # columns: moves by (-1, 0, 0); doubles x and moves by (0, -1, -2)
    inverse = [
        (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -1, 0, 0, 1),
        (2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, -2, 1),
    ]
    file.add("skins", joints=[1, 2], **({"inverseBindMatrices": file.accessor(inverse)} | more))
    return file


def by_first(p):
    """Where the first joint puts a point: it stands where it was bound."""
    return np.array(p, float)


def by_second(p):
    """Where the second joint puts it: bound, turned a quarter about z, moved by both nodes."""
    x, y, z = 2 * p[0], p[1] - 1, p[2] - 2
    return np.array((-y + 1, x + 1, z))


@pytest.mark.parametrize(("component", "most"), [(UBYTE, 255), (USHORT, 65535)])
def test_skin_of_two_joints(component, most, tmp_path):
    """The mesh's own node does not count. Weights that sum to less are scaled up."""
    weights = [(most, 0, 0, 0), (100, 50, 0, 0), (most - 3, 0, 1, 2)]
    joints = [(0, 1, 1, 1), (1, 0, 0, 0), (0, 1, 1, 1)]
    there = corners(skinned([joints], [weights], component).load(tmp_path))[0]
    a, b, c = CORNERS
    small = 3 / most
    expected = [
        by_first(a),
        (2 * by_second(b) + by_first(b)) / 3,
        (1 - small) * by_first(c) + small * by_second(c),
    ]
    np.testing.assert_allclose(there, expected, **CLOSE)


def test_second_set_of_joints_counts(tmp_path):
    first, second = [(0, 0, 0, 0)] * 3, [(1, 0, 0, 0)] * 3
    weights = [(51, 0, 0, 0)] * 3, [(204, 0, 0, 0), (0, 0, 0, 0), (51, 51, 0, 0)]
    there = corners(skinned([first, second], weights).load(tmp_path))[0]
    shares = [0.8, 0, 1 / 3]
    expected = [
        (1 - s) * by_first(p) + s * by_second(p) for s, p in zip(shares, CORNERS, strict=True)
    ]
    np.testing.assert_allclose(there, expected, **CLOSE)


def test_a_vertex_without_weights_goes_with_its_first_joint(tmp_path):
    scene = skinned([[(1, 0, 0, 0)] * 3], [[(0, 0, 0, 0)] * 3]).load(tmp_path)
    np.testing.assert_allclose(corners(scene)[0], [by_second(p) for p in CORNERS], **CLOSE)


def test_joints_move(tmp_path):
    file = skinned([[(1, 0, 0, 0)] * 3], [[(255, 0, 0, 0)] * 3])
    file.animation(1, "translation", [0, 1], [(1, 0, 0), (1, 0, 8)])
    scene = file.load(tmp_path, fps=2)
    for frame in range(3):
        expected = [by_second(p) + (0, 0, 4 * frame) for p in CORNERS]
        np.testing.assert_allclose(corners(scene, frame)[0], expected, **CLOSE)


def morphing(mesh_weights=None, node_weights=None) -> File:
    file = File()
    mesh = file.mesh()
    part = file.json["meshes"][mesh]["primitives"][0]
    part["targets"] = [
        {"POSITION": file.accessor([(1, 0, 0), (0, 1, 0), (0, 0, 1)])},
        {"NORMAL": file.accessor([(0, 0, 1)] * 3)},
        {"POSITION": file.accessor([(0, 4, 0), (0, 0, 4), (4, 0, 0)])},
    ]
    if mesh_weights:
        file.json["meshes"][mesh]["weights"] = mesh_weights
    file.add("nodes", mesh=mesh, **({"weights": node_weights} if node_weights else {}))
    return file


def morphed(a: float, b: float) -> np.ndarray:
    return np.add(CORNERS, [(a, 4 * b, 0), (0, a, 4 * b), (4 * b, 0, a)])


@pytest.mark.parametrize(
    ("mesh", "node", "expected"),
    [
        (None, None, (0, 0)),
        ([0.5, 9, 0.25], None, (0.5, 0.25)),
        (None, [2, 9, -1], (2, -1)),
        ([0.5, 9, 0.25], [2, 9, -1], (2, -1)),
        ([0.5, 9, 0.25], [0, 0, 0], (0, 0)),
    ],
)
def test_default_weights_of_mesh_and_node(mesh, node, expected, tmp_path):
    """The node's, where it has any, replace the mesh's."""
    there = corners(morphing(mesh, node).load(tmp_path))
    np.testing.assert_array_equal(there, [morphed(*expected)])


def test_animated_weights(tmp_path):
    """One number a target and key, all in one row; the defaults do not count."""
    file = morphing([5, 5, 5])
    file.animation(0, "weights", [0, 2], [0, 9, 1, 1, 9, -1])
    scene = file.load(tmp_path, fps=2)
    assert scene.frames == 5
    for frame in range(5):
        s = frame / 4
        np.testing.assert_allclose(corners(scene, frame)[0], morphed(s, 1 - 2 * s), **CLOSE)


def test_animated_cubic_weights(tmp_path):
    """Per key all tangents in, then all weights, then all tangents out: here t² and 2 t."""
    file = morphing()
    values = [FAR, FAR, FAR, 0, 0, 0, 0, 0, 2, 4, 0, 2, 4, 0, 4, FAR, FAR, FAR]
    file.animation(0, "weights", [0, 2], values, "CUBICSPLINE")
    scene = file.load(tmp_path, fps=4)
    for frame in range(9):
        t = frame / 4
        np.testing.assert_allclose(corners(scene, frame)[0], morphed(t * t, 2 * t), **CLOSE)
