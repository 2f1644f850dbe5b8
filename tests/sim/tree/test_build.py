"""sim.tree.build: proper trees of the least cost, over meshes of every kind."""

import numpy as np
import pytest
from hypothesis import given, settings

from sim.tree.build import BUILDERS, build
from sim.tree.cost import cost, refit
from sim.tree.grow import MAX_DEPTH, REGION_WEIGHT
from sim.tree.shape import check, depth
from tests.sim.tree import oracle
from tests.sim.tree.meshes import awkward_meshes, bumpy_sphere, exponential, soup


def pose_cost(tree, vertices, faces) -> float:
    return cost(tree, refit(tree, vertices, faces), oracle.box_of(vertices[faces]))


def assert_splits_cost_least(tree, vertices, faces):
    """At every node: the split is a partition of a sorted list, and none costs less."""
    corners = vertices[faces]

    def visit(node, region):
        sides = [oracle.leaves(tree, child) for child in tree.children[node].tolist()]
        axis = int(tree.axis[node])
        partitions = list(oracle.all_partitions(corners, sides[0] + sides[1]))
        assert set(sides[0]) in [set(left) for left, _ in partitions], f"node {node}"
        least = min(
            oracle.split_cost(corners, region, partition, bounded, REGION_WEIGHT)
            for partition in partitions
            for bounded in range(3)
        )
        found = oracle.split_cost(corners, region, sides, axis, REGION_WEIGHT)
        assert found <= least * (1 + 1e-9), f"node {node}: {found} > {least}"
        for child, side in zip(tree.children[node].tolist(), sides, strict=True):
            if child >= 0:
                visit(child, oracle.clipped(region, oracle.box_of(corners[side]), axis))

    visit(0, oracle.box_of(corners))


@pytest.mark.parametrize("size", [0.001, 0.1, 1.0])
def test_sah_splits_cost_least(rng, size):
    for triangles in (2, 3, 7, 40):
        mesh = soup(rng, triangles, size)
        assert_splits_cost_least(build(*mesh), *mesh)


@settings(max_examples=30, deadline=None)
@given(awkward_meshes(most=12))
def test_sah_splits_cost_least_on_awkward_meshes(mesh):
    vertices, faces = mesh
    if len(faces) > 1 and np.abs(vertices).max() <= 10:  # the oracle's areas overflow
        assert_splits_cost_least(build(vertices, faces), vertices, faces)


@pytest.mark.parametrize("builder", BUILDERS)
@settings(max_examples=100, deadline=None)
@given(mesh=awkward_meshes())
def test_awkward_meshes_give_proper_trees(builder, mesh):
    vertices, faces = mesh
    tree = build(vertices, faces, builder)
    check(tree, len(faces))
    assert depth(tree) <= max(len(faces) - 1, 1)
    scaled = build(np.ldexp(vertices, -7), faces, builder)
    assert np.array_equal(tree.children, scaled.children)
    assert np.array_equal(tree.axis, scaled.axis)


@pytest.mark.parametrize("builder", BUILDERS)
def test_one_triangle_is_both_children(builder):
    tree = build(np.eye(3), np.array([[0, 1, 2]]), builder)
    assert tree.children.tolist() == [[~0, ~0]]
    check(tree, 1)


@pytest.mark.parametrize("builder", BUILDERS)
def test_coincident_triangles_give_a_balanced_tree(builder):
    for vertices in (np.eye(3), np.zeros((3, 3)), np.full((3, 3), 0.1)):
        tree = build(vertices, np.tile(np.arange(3, dtype=np.int32), (5000, 1)), builder)
        check(tree, 5000)
        assert depth(tree) == 13


def test_medians_split_where_they_say():
    """Triangles at x = 0, 1, 2, 3, 100, given out of order: the middle is 50, the median 2."""
    x = np.array([3.0, 100, 0, 2, 1])
    vertices = (x[:, None, None] * [1, 0, 0] + 0.1 * np.eye(3)).reshape(-1, 3)
    faces = np.arange(15, dtype=np.int32).reshape(-1, 3)

    def left(builder):
        tree = build(vertices, faces, builder)
        assert tree.axis[0] == 0
        return sorted(x[oracle.leaves(tree, tree.children[0, 0])])

    assert left("spatial-median") == [0, 1, 2, 3]
    assert left("object-median") == [0, 1]


def test_chains_stop_at_the_deepest_level():
    """Where a chain costs least it is built, and ends in balance at MAX_DEPTH levels."""
    assert depth(build(*exponential(40, 64.0))) == 39
    for triangles, factor in ((100, 64.0), (100_000, 1.005)):
        for builder in ("sah", "spatial-median"):
            tree = build(*exponential(triangles, factor), builder)
            check(tree, triangles)
            assert depth(tree) == MAX_DEPTH


@pytest.mark.parametrize("builder", BUILDERS)
def test_a_mesh_of_131_thousand_triangles(builder):
    vertices, faces = bumpy_sphere(7)
    tree = build(vertices, faces, builder)
    check(tree, 131_072)
    assert depth(tree) <= 32


def test_sah_beats_the_medians_on_a_moving_elephant(scene_file):
    scene = np.load(scene_file("elephant.npz"))
    faces, frames = scene["faces"], scene["vertices"].astype(np.float64)
    trees = {builder: build(frames[0], faces, builder) for builder in BUILDERS}
    for vertices in frames[::8]:
        costs = {builder: pose_cost(trees[builder], vertices, faces) for builder in BUILDERS}
        assert costs["sah"] < 0.8 * costs["spatial-median"], costs
        assert costs["sah"] < 0.8 * costs["object-median"], costs


@pytest.mark.parametrize(
    ("vertices", "faces", "builder", "message"),
    [
        (np.eye(3), np.array([[0, 1, 2]]), "bvh", "no builder 'bvh'"),
        (np.eye(3), np.zeros((0, 3), int), "sah", r"\(0, 3\)"),
        (np.eye(3)[:, :2], np.array([[0, 1, 2]]), "sah", r"\(3, 2\)"),
        (np.eye(3), np.array([[0, 1, 2], [0, 3, 1]]), "sah", "triangle 1 names vertex 3 of 3"),
        (np.eye(3), np.array([[0, 1, -1]]), "sah", "triangle 0 names vertex -1 of 3"),
        (np.diag([1, np.nan, 1]), np.array([[0, 1, 2]]), "sah", "vertex 1 is not finite"),
    ],
)
def test_bad_input_is_refused(vertices, faces, builder, message):
    with pytest.raises(ValueError, match=message):
        build(vertices, faces, builder)
