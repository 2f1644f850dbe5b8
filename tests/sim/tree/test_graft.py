"""sim.tree.graft: trees in the places of leaves."""

import numpy as np
import pytest

from sim.tree.build import build
from sim.tree.graft import graft
from sim.tree.shape import check


def tree_over(rng, triangles: int):
    return build(rng.random((3 * triangles, 3)), np.arange(3 * triangles).reshape(-1, 3))


@pytest.mark.parametrize("items", [2, 3, 5])
def test_every_leaf_has_its_place(items, rng):
    for sizes in rng.integers(0, 6, (20, items)).tolist():
        begins = np.cumsum([0, *(max(size, 1) for size in sizes)]).tolist()
        trees = [tree_over(rng, size) if size else None for size in sizes]
        whole = graft(tree_over(rng, items), list(zip(trees, begins, strict=False)))
        check(whole, begins[-1])


def test_trees_stay_as_they_are(rng):
    top, first, second = (tree_over(rng, n) for n in (2, 4, 3))
    whole = graft(top, [(first, 0), (second, 4)])
    assert whole.axis.tolist() == [*top.axis, *first.axis, *second.axis]
    assert set((~whole.children[whole.children < 0]).tolist()) == set(range(7))
    below = first.children
    assert (whole.children[1:4] == np.where(below >= 0, below + 1, below)).all()
