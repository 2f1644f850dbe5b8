"""sim.oracle.bvh: every triangle once, in a box that holds it."""

import numpy as np
import pytest

from sim.oracle.bvh import LEAF, build
from sim.scene.builtin.shapes import sphere


def soup(rng, count):
    return rng.standard_normal((count, 3, 3))


def mesh(rng, name):
    if name == "sphere":
        vertices, faces = sphere(80_000)
        return vertices[faces]
    if name == "coincident":
        return np.repeat(soup(rng, 1), 1000, axis=0)
    if name == "no area":
        return np.repeat(rng.standard_normal((100, 1, 3)), 3, axis=1)
    if name == "in a row":
        return np.zeros((1000, 3, 3)) + np.arange(1000.0)[:, None, None]
    return soup(rng, int(name))


def check(bvh, corners, node=0, level=0) -> tuple[list[int], int]:
    """Triangles below a node and the level of the deepest leaf."""
    begin, count = bvh.links[node].tolist()
    if count:
        assert count <= LEAF
        triangles, deepest = bvh.triangles[begin : begin + count].tolist(), level
    else:
        left = check(bvh, corners, node + 1, level + 1)
        right = check(bvh, corners, begin, level + 1)
        triangles, deepest = left[0] + right[0], max(left[1], right[1])
    points = corners[triangles].reshape(-1, 3)
    assert bvh.boxes[node].tolist() == [*points.min(axis=0), *points.max(axis=0)], f"node {node}"
    return triangles, deepest


@pytest.mark.parametrize("name", ["1", "2", "4", "5", "999", "coincident", "no area", "in a row"])
def test_each_triangle_lies_once_in_tight_boxes(rng, name):
    corners = mesh(rng, name)
    triangles, deepest = check(build(corners), corners)
    assert sorted(triangles) == list(range(len(corners)))
    assert deepest <= np.ceil(np.log2(len(corners)))


def test_large_mesh():
    corners = mesh(None, "sphere")
    bvh = build(corners)
    assert sorted(bvh.triangles.tolist()) == list(range(len(corners)))
    leaves = bvh.links[:, 1] > 0
    assert bvh.links[leaves, 1].sum() == len(corners)


def test_split_is_by_position_on_the_longest_axis(rng):
    """Boxes of a row of triangles along y do not overlap, in whatever order they are given."""
    corners = np.arange(1000.0)[:, None, None] * [0, 1, 0] + rng.random((1000, 1, 3)) * [9, 0.5, 9]
    bvh = build(corners.repeat(3, axis=1)[rng.permutation(1000)])
    first, second = sorted(bvh.boxes[[1, bvh.links[0, 0]]], key=lambda box: box[1])
    assert first[4] < second[1]


def test_refuses_no_triangles():
    with pytest.raises(ValueError, match=r"one triangle at least, not \(0, 3, 3\)"):
        build(np.empty((0, 3, 3)))
