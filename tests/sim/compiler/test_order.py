"""sim.compiler.order and sequence: post-order, in few box registers, sharing vertices."""

import re

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sim.compiler.order import order
from sim.errors import InputError
from sim.tree.tree import Tree
from tests.sim.compiler.trees import (
    balanced,
    chain,
    leaves_below,
    needs,
    order_shape,
    random_tree,
    shape,
    trees,
)

ANY = 1 << 20


def soup(triangles: int):
    """Triangles that share nothing: only box registers decide on their order."""
    return np.arange(3 * triangles, dtype=np.int32).reshape(-1, 3)


def sharing(seed: int, triangles: int):
    """Triangles over half as many vertices, as a closed mesh has; some degenerate."""
    rng = np.random.default_rng(seed)
    return rng.integers(0, triangles // 2 + 1, (triangles, 3)).astype(np.int32)


def assert_post_order(found, triangles: int):
    """Everything that the docstring of Order says of its arrays."""
    nodes = max(triangles - 1, 1)
    assert found.children.shape == (nodes, 2) and found.children.dtype == np.int32
    assert found.axis.shape == (nodes,) and found.axis.dtype == np.uint8
    assert found.triangles.shape == (nodes + 1,) and found.triangles.dtype == np.int32
    places = np.bincount(found.triangles, minlength=triangles)
    assert (places == (2 if triangles == 1 else 1)).all()

    size = np.ones(nodes, int)  # nodes of a subtree
    for node, (left, right) in enumerate(found.children.tolist()):
        if right >= 0:
            assert right == node - 1, f"right child of node {node}"
            size[node] += size[right]
            if left >= 0:
                assert left == right - size[right], f"left child of node {node}"
                size[node] += size[left]
        else:
            assert left < 0, f"node {node} has its leaf on the right"
            assert ~right == ~left + 1, f"leaves of node {node}"
    assert size[-1] == nodes
    # Leaves, taken as a node asks for them, count up; so those of a subtree follow each other.
    asked = [~child for pair in found.children.tolist() for child in pair if child < 0]
    assert asked == list(range(nodes + 1))


def pressure(found) -> int:
    """The most boxes alive at once, when leaves are merged as nodes ask for them."""
    alive = most = 0
    for pair in found.children.tolist():
        alive += sum(child < 0 for child in pair)
        most = max(most, alive)
        alive -= 1
    assert alive == 1
    return most


def fewest(tree: Tree) -> int:
    """The fewest boxes of any order of merges whatsoever, by search."""
    children = [[c if c >= 0 else c - 1000 for c in pair] for pair in tree.children.tolist()]
    leaves = {c for pair in children for c in pair if c < 0}
    for limit in range(1, len(leaves) + 1):
        seen, todo = set(), [frozenset()]  # what was merged, of leaves and nodes
        while todo:
            done = todo.pop()
            if 0 in done:
                return limit
            alive = done - {c for node in done if node >= 0 for c in children[node]}
            ready = [n for n, pair in enumerate(children) if n not in done and alive >= set(pair)]
            if len(alive) < limit:
                ready += leaves - done
            for item in ready:
                if (after := done | {item}) not in seen:
                    seen.add(after)
                    todo.append(after)
    raise AssertionError("no order found")


def assert_greedy(found, faces, need, boxes: int):
    """Of two children that both fit, the first pulls more: as the docstring of sequence says."""
    vertices = faces[found.triangles]  # of each leaf
    spans = {}
    for child in range(-len(found.triangles), len(found.axis)):
        parts = [spans[c] for c in found.children[child].tolist()] if child >= 0 else []
        spans[child] = (~child, ~child + 1) if child < 0 else (min(parts)[0], max(parts)[1])

    def pull(child, before, after):
        corners = vertices[slice(*spans[child])].ravel().tolist()
        past = set(vertices[:before].ravel().tolist())
        future = set(vertices[slice(*after)].ravel().tolist())
        return sum(v in past for v in corners) - sum(v in future for v in corners)

    todo = [(len(found.axis) - 1, boxes, (0, 0))]
    while todo:
        node, free, after = todo.pop()
        if node < 0:
            continue
        first, second = found.children[node].tolist()
        if first < 0 <= second:
            first, second = second, first  # a leaf beside a node comes after it
        elif max(need(first), need(second)) < free:
            before = spans[node][0]
            pulls = [pull(child, before, after) for child in (first, second)]
            assert pulls[0] >= pulls[1], f"node {node}"
            if pulls[0] == pulls[1]:
                assert need(first) >= need(second), f"node {node}"
        else:
            assert need(first) >= need(second), f"node {node}"
        todo += [(second, free - 1, after), (first, free, spans[second])]


@settings(max_examples=100, deadline=None)
@given(trees(most=30), st.integers(0, 2**32 - 1), st.integers(0, 20))
@example(balanced(3), 0, 20)
@example(chain(9, leaf_left=True), 0, 0)
@example(chain(9, leaf_left=False), 0, 4)
def test_random_trees(tree, seed, more):
    triangles = int((~tree.children).max()) + 1
    faces, least = sharing(seed, triangles), needs(tree)[0]
    registers = least + more
    found = order(tree, faces, registers)
    assert_post_order(found, triangles)
    assert order_shape(found, len(found.axis) - 1) == shape(tree)
    assert least <= found.boxes == pressure(found) <= max(least, registers // 2)
    below = needs(found)
    spare = max(least, registers // 2)
    assert_greedy(found, faces, lambda child: below[child] if child >= 0 else 1, spare)


@settings(max_examples=60, deadline=None)
@given(trees(most=7, least=2))
def test_no_order_at_all_takes_fewer_boxes(tree):
    fewest_boxes = fewest(tree)
    assert order(tree, sharing(1, len(tree.axis) + 1), fewest_boxes).boxes == fewest_boxes
    assert fewest_boxes <= np.log2(len(tree.axis) + 1) + 1


@pytest.mark.parametrize("leaf_left", [True, False])
def test_chain_takes_two_boxes_at_any_depth(leaf_left):
    tree = chain(100_000, leaf_left)
    found = order(tree, soup(100_000), 2)
    assert_post_order(found, 100_000)
    assert found.boxes == pressure(found) == 2
    assert sorted(found.axis.tolist()) == sorted(tree.axis.tolist())


@pytest.mark.parametrize("levels", range(1, 13))
def test_balanced_tree_takes_one_box_a_level(levels):
    found = order(balanced(levels), soup(1 << levels), levels + 1)
    assert_post_order(found, 1 << levels)
    assert found.boxes == pressure(found) == levels + 1


def test_fan_of_one_vertex(rng):
    """Time must not grow with the triangles that share a vertex: this would take an hour."""
    faces = soup(100_000)
    faces[:, 0] = 0
    tree = random_tree(rng, 100_000)
    assert_post_order(order(tree, faces, 64), 100_000)


def test_large_random_tree(rng):
    tree = random_tree(rng, 50_000)
    found = order(tree, sharing(1, 50_000), 64)
    assert_post_order(found, 50_000)
    assert needs(tree)[0] <= found.boxes == pressure(found) <= 32


def test_one_triangle_is_both_leaves():
    found = order(Tree(np.full((1, 2), ~0, np.int32), np.array([2], np.uint8)), soup(1), 2)
    assert found.children.tolist() == [[~0, ~1]]
    assert found.triangles.tolist() == [0, 0]
    assert found.axis.tolist() == [2] and found.boxes == 2


def test_swaps_the_child_that_needs_more_to_the_front():
    """By hand: a pair left of four that are balanced, which need three boxes."""
    children = [[1, 2], [~0, ~1], [3, 4], [~2, ~3], [~4, ~5]]
    tree = Tree(np.array(children, np.int32), np.arange(5, dtype=np.uint8) % 3)
    found = order(tree, soup(6), 3)
    assert found.children.tolist() == [[~0, ~1], [~2, ~3], [0, 1], [~4, ~5], [2, 3]]
    assert found.triangles.tolist() == [2, 3, 4, 5, 0, 1]
    assert found.axis.tolist() == [0, 1, 2, 1, 0]
    assert found.boxes == 3


@pytest.mark.parametrize("near", [0, 1])
def test_what_shares_with_the_next_subtree_comes_last(near):
    """By hand: two pairs, then one that shares a vertex with one of them."""
    children = [[1, 2], [3, 4], [~4, ~5], [~0, ~1], [~2, ~3]]
    tree, faces = Tree(np.array(children, np.int32), np.zeros(5, np.uint8)), soup(6)
    faces[4, 0] = faces[2 * near, 1]
    found = order(tree, faces, 64)
    # The pair below the root pulls nowhere; of its four leaves, the near ones are in the middle.
    assert set(found.triangles[:2].tolist()) == {2 - 2 * near, 3 - 2 * near}
    assert found.triangles[3:5].tolist() == [2 * near, 4]


@pytest.mark.parametrize("near", [0, 1])
def test_what_shares_with_the_leaves_before_comes_first(near):
    """By hand: four leaves in two pairs, then two pairs of which one shares with the first."""
    children = [[1, 2], [3, 4], [5, 6], [7, 8], [~4, ~5], [~6, ~7], [~8, ~9], [~0, ~1], [~2, ~3]]
    tree, faces = Tree(np.array(children, np.int32), np.zeros(9, np.uint8)), soup(10)
    faces[6 + 2 * near, 0] = faces[0, 0]
    found = order(tree, faces, 64)
    assert set(found.triangles[:6].tolist()) == set(range(6))  # needs more boxes
    assert found.triangles[6] == 6 + 2 * near


def assert_names_smallest(tree, registers):
    need = needs(tree)
    sizes = [len(leaves_below(tree.children, node)) for node in range(len(need))]
    with pytest.raises(InputError, match="box registers") as caught:
        order(tree, soup(len(tree.axis) + 1), registers)
    pattern = r"subtree of node (\d+) \((\d+) triangles\) needs (\d+) box registers: "
    node, triangles, told = map(int, re.search(pattern, str(caught.value)).groups())
    assert told == need[node] > registers
    assert (
        triangles
        == sizes[node]
        == min(size for size, n in zip(sizes, need, strict=True) if n > registers)
    )
    assert f"box_registers is {registers} and has to be {need[0]}" in str(caught.value)


@pytest.mark.parametrize("registers", [2, 3, 4])
def test_too_few_registers_names_the_smallest_subtree(registers, rng):
    for _ in range(20):
        tree = random_tree(rng, 300)
        assert order(tree, soup(300), needs(tree)[0]).boxes == needs(tree)[0]
        if needs(tree)[0] > registers:
            assert_names_smallest(tree, registers)


def test_smallest_subtree_of_two_apart():
    """Below the root four balanced triangles, and later a chain that ends in five more."""
    children = [[1, 4], [2, 3], [~0, ~1], [~2, ~3], [5, 6], [7, ~4], [~5, ~6], [~7, ~8]]
    assert_names_smallest(Tree(np.array(children, np.int32), np.zeros(8, np.uint8)), 2)


def test_is_deterministic_and_leaves_its_input(rng):
    tree = random_tree(rng, 500)
    before = tree.children.copy(), tree.axis.copy()
    first, second = (order(tree, sharing(1, 500), 64) for _ in range(2))
    assert (first.children == second.children).all()
    assert (first.triangles == second.triangles).all()
    assert (tree.children == before[0]).all() and (tree.axis == before[1]).all()
