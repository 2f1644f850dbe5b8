"""sim.tree.shape: every breach of a tree's contract is named."""

import numpy as np
import pytest

from sim.tree.shape import check, depth
from sim.tree.tree import Tree

GOOD = [[1, 2], [~0, ~1], [~2, ~3]]


def tree(children, axis=None) -> Tree:
    axis = [0] * len(children) if axis is None else axis
    return Tree(np.array(children, np.int32), np.array(axis, np.uint8))


def test_proper_trees_pass():
    check(tree(GOOD), 4)
    check(tree([[~0, ~0]]), 1)
    check(tree([[~1, ~0]]), 2)


def test_depth_counts_levels_of_nodes():
    assert depth(tree([[~0, ~0]])) == 1
    assert depth(tree(GOOD)) == 2
    assert depth(tree([[~0, 1], [2, ~1], [~3, ~2]])) == 3


@pytest.mark.parametrize(
    ("bad", "triangles", "message"),
    [
        (tree(GOOD), 5, r"\(3, 2\) int32, not \(4, 2\)"),
        (Tree(np.array(GOOD), np.zeros(3, np.uint8)), 4, "int64"),
        (tree(GOOD, [0, 0]), 4, r"axis is \(2,\)"),
        (Tree(np.array(GOOD, np.int32), np.zeros(3)), 4, "float64"),
        (tree(GOOD, [0, 3, 0]), 4, "node 1 has axis 3"),
        (tree([[1, 2], [~0, ~1], [~2, ~2]]), 4, "triangle 2 is in 2 places, not 1"),
        (tree([[1, 2], [~0, ~1], [~2, ~4]]), 4, "no triangle 4"),
        (tree([[1, 3], [~0, ~1], [~2, ~3]]), 4, "no node 3, only 3"),
        (tree([[1, 1], [~0, ~1], [~2, ~3]]), 4, "node 1 is in 2 places"),
        (tree([[1, ~0], [1, ~1], [~2, ~3]]), 4, "node 1 is not after its parent 1"),
        (tree([[0, 1], [~0, ~1], [~2, ~3]]), 4, "node 0 is not after its parent 0"),
        (tree([[2, ~0], [~1, ~2], [1, ~3]]), 4, "node 1 is not after its parent 2"),
        (tree([[~0, ~1]]), 1, "no triangle 1"),
    ],
)
def test_improper_trees_are_refused(bad, triangles, message):
    with pytest.raises(ValueError, match=message):
        check(bad, triangles)
