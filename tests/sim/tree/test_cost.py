"""sim.tree.cost against brute force and against lines shot at random."""

import numpy as np
import pytest
from hypothesis import given, settings

from sim.tree.build import BUILDERS, build
from sim.tree.cost import C_STEP, C_TRIANGLE, cost, refit
from sim.tree.tree import Tree
from tests.sim.tree import oracle
from tests.sim.tree.meshes import awkward_meshes, bumpy_sphere, soup

LINES = 100_000


def assert_bounds_are_tight(tree, vertices, faces):
    bounds = refit(tree, vertices, faces)
    assert bounds.shape == (len(tree.children), 4)
    for node, axis in enumerate(tree.axis):
        expected = [
            oracle.box_of(vertices[faces[oracle.leaves(tree, child)]])[:, axis]
            for child in tree.children[node].tolist()
        ]
        assert bounds[node].tolist() == np.concatenate(expected).tolist(), f"node {node}"


@settings(max_examples=50, deadline=None)
@given(awkward_meshes(most=20))
def test_refit_is_min_and_max_below_every_node(mesh):
    for builder in BUILDERS:
        assert_bounds_are_tight(build(*mesh, builder), *mesh)


def test_refit_to_another_pose(rng):
    vertices, faces = bumpy_sphere(3)
    tree = build(vertices, faces)
    assert_bounds_are_tight(tree, vertices + 0.3 * rng.standard_normal(vertices.shape), faces)


@pytest.mark.parametrize("builder", BUILDERS)
@pytest.mark.parametrize("mesh", ["soup", "sphere", "flat", "moved"])
def test_cost_is_what_random_lines_pay(rng, mesh, builder):
    vertices, faces = bumpy_sphere(2) if mesh == "sphere" else soup(rng, 60)
    if mesh == "flat":
        vertices[:, 2] = 0
    tree = build(vertices, faces, builder)
    if mesh == "moved":
        vertices = vertices + 0.2 * rng.standard_normal(vertices.shape)

    bounds, box = refit(tree, vertices, faces), oracle.box_of(vertices)
    lines = oracle.lines_through(rng, box, LINES)
    assert len(lines[0]) > LINES // 5
    steps, tests = oracle.traverse(tree, bounds, 0, *lines)
    paid = C_STEP * steps + C_TRIANGLE * tests
    error = paid.std() / np.sqrt(len(paid))
    assert abs(cost(tree, bounds, box) - paid.mean()) < 5 * error


def test_cost_by_hand(monkeypatch):
    """Two unit squares' halves at x = 0 and x = 1 of a unit cube: flat regions of area 2 in 6."""
    vertices = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, 0], [1, 0, 1.0]])
    faces = np.arange(6, dtype=np.int32).reshape(2, 3)
    tree = build(vertices, faces)
    assert tree.axis.tolist() == [0]
    bounds = refit(tree, vertices, faces)
    assert bounds.tolist() == [[0, 0, 1, 1]]
    found = cost(tree, bounds, oracle.box_of(vertices))
    assert found == pytest.approx(C_STEP + 2 * C_TRIANGLE / 3)
    monkeypatch.setattr("sim.tree.cost.C_TRIANGLE", 6.0)
    assert cost(tree, bounds, oracle.box_of(vertices)) == pytest.approx(C_STEP + 4)


@pytest.mark.parametrize("scale", [1e-300, 1e-9, 1e200])
def test_cost_has_no_scale(rng, scale):
    vertices, faces = soup(rng, 50)
    tree = build(vertices, faces)
    costs = [
        cost(tree, refit(tree, v, faces), oracle.box_of(v)) for v in (vertices, vertices * scale)
    ]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


def test_a_box_without_area_costs_the_whole_tree():
    vertices = np.arange(9.0)[:, None] * [1, 0, 0]
    faces = np.arange(9, dtype=np.int32).reshape(3, 3)
    tree = build(vertices, faces)
    found = cost(tree, refit(tree, vertices, faces), oracle.box_of(vertices))
    assert found == 2 * C_STEP + 3 * C_TRIANGLE


def test_bounds_outside_their_region_are_never_entered():
    tree = Tree(np.array([[~0, ~1]], np.int32), np.zeros(1, np.uint8))
    bounds = np.array([[0.0, 1.0, 2.0, 3.0]])
    assert cost(tree, bounds, np.array([[0.0, 0, 0], [1, 1, 1]])) == C_STEP + C_TRIANGLE


def test_arrays_that_only_read(rng):
    """As a memory map gives them, and in Fortran's order."""
    vertices, faces = soup(rng, 10)
    tree = build(vertices, faces)
    bounds, box = refit(tree, vertices, faces), oracle.box_of(vertices)
    other = Tree(np.asfortranarray(tree.children), tree.axis.copy())
    arrays = [np.asfortranarray(a) for a in (vertices, faces, bounds, box)]
    for array in (*arrays, other.children, other.axis):
        array.flags.writeable = False
    assert np.array_equal(refit(other, *arrays[:2]), bounds)
    assert cost(other, *arrays[2:]) == cost(tree, bounds, box)
    assert np.array_equal(build(*arrays[:2]).children, tree.children)
