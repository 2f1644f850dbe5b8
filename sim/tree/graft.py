"""Trees put together: a tree over boxes, with trees of their own in the places of some."""

from collections.abc import Sequence

import numpy as np

from sim.tree.tree import Tree


def graft(top: Tree, items: Sequence[tuple[Tree | None, int]]) -> Tree:
    """A tree in which leaf k of `top` has become the tree of item k.

    Parameters
    ----------
    top : Tree
        Over the items, two at least.
    items : sequence of (Tree or None, int)
        The tree, and the leaf that its leaf 0 becomes; without a tree the leaf itself. A tree over
        one triangle is that leaf.

    Returns
    -------
    Tree
        Parents before children.
    """
    trees = [tree if tree and (tree.children != ~0).any() else None for tree, _ in items]
    roots, children, axes = [], [], [top.axis]
    offset = len(top.children)
    for tree, (_, first) in zip(trees, items, strict=True):
        if tree is None:
            roots.append(~first)
            continue
        roots.append(offset)
        below = tree.children
        children.append(np.where(below >= 0, below + offset, below - first))
        axes.append(tree.axis)
        offset += len(below)
    places = np.array(roots, np.int32)
    above = np.where(top.children >= 0, top.children, places[np.maximum(~top.children, 0)])
    joined = np.concatenate([above, *children]).astype(np.int32)
    return Tree(joined, np.concatenate(axes))
