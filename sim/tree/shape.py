"""Facts about the shape of a tree that hold in every pose."""

import numpy as np

from sim.tree.tree import Tree


def depth(tree: Tree) -> int:
    """Levels of nodes on the longest path from the root; leaves are not counted."""
    levels = 0
    level = np.zeros(1, np.int32)
    while len(level):
        levels += 1
        below = tree.children[level].ravel()
        level = below[below >= 0]
    return levels


def check(tree: Tree, triangles: int):
    """Hold a tree, whoever made it, to the contract of Tree over a mesh of so many triangles.

    Raises
    ------
    ValueError
        Wrong shapes or types, an axis that is none, a node before its parent, or a node or
        triangle that has not exactly one place. Names the first culprit.
    """
    children, axis = tree.children, tree.axis
    nodes = max(triangles - 1, 1)
    if children.shape != (nodes, 2) or children.dtype != np.int32:
        raise ValueError(
            f"children are {children.shape} {children.dtype}, "
            f"not ({nodes}, 2) int32 for {triangles} triangles"
        )
    if axis.shape != (nodes,) or axis.dtype != np.uint8:
        raise ValueError(f"axis is {axis.shape} {axis.dtype}, not ({nodes},) uint8")
    if axis.max() > 2:
        node = int(axis.argmax())
        raise ValueError(f"node {node} has axis {axis[node]}, not 0, 1 or 2")

    parents, sides = np.nonzero(children >= 0)
    inner = children[parents, sides]
    # With one parent each, and that before it, every node hangs below the root.
    early = np.flatnonzero(inner <= parents)
    if len(early):
        raise ValueError(f"node {inner[early[0]]} is not after its parent {parents[early[0]]}")
    _check_once("node", inner, np.arange(nodes) > 0)
    places = 2 if triangles == 1 else 1
    _check_once("triangle", ~children[children < 0], np.full(triangles, places))


def _check_once(what: str, found: np.ndarray, places: np.ndarray):
    """Each item i must be found places[i] times."""
    beyond = found[found >= len(places)]
    if len(beyond):
        raise ValueError(f"there is no {what} {beyond[0]}, only {len(places)}")
    count = np.bincount(found, minlength=len(places))
    wrong = np.flatnonzero(count != places)
    if len(wrong):
        item = wrong[0]
        raise ValueError(f"{what} {item} is in {count[item]} places, not {int(places[item])}")
