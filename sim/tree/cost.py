"""What a B-KD tree costs a ray, in any pose of its mesh."""

import numpy as np
from numba import njit

from sim.tree.tree import Tree

# In cycles. The traversal unit takes one packet step a cycle and the triangle unit one packet
# test: neither is the dearer one.
C_STEP = 1.0
C_TRIANGLE = 1.0


def refit(tree: Tree, vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Bounds of every node in one pose.

    Parameters
    ----------
    tree : Tree
        Over the T triangles of `faces`; not checked here, see `sim.tree.shape.check`.
    vertices : (V, 3) float64
        Of the pose.
    faces : (T, 3) int
        Vertex indices, as the tree was built.

    Returns
    -------
    (N, 4) float64
        Left low, left high, right low, right high on the node's axis, exact.
    """
    corners = [np.asarray(vertices, np.float64)[faces[:, k]] for k in range(3)]
    low = np.minimum(np.minimum(corners[0], corners[1]), corners[2])
    high = np.maximum(np.maximum(corners[0], corners[1]), corners[2])
    return _refit(*_arrays(tree), np.concatenate([low, high], axis=1))


def cost(tree: Tree, bounds: np.ndarray, box: np.ndarray) -> float:
    """SAH cost: expected cycles of a random line that meets the scene's box.

    The region of the root is the scene's box, that of a child its node's region clipped to the
    child's bounds, so on one axis. A line that meets the box meets a convex region inside it with
    the probability of the ratio of surface areas (Crofton; Goldsmith and Salmon 1987). It pays
    C_STEP for a node whose region it meets and C_TRIANGLE for a leaf: rays that end early at a
    hit, and the packets that rays travel in, are left out.

    Parameters
    ----------
    tree : Tree
        In any shape that `sim.tree.shape.check` passes.
    bounds : (N, 4) float64
        As refit gives them.
    box : (2, 3) float64
        The scene's box in the same pose, low and high. Bounds alone do not hold it: a tree need
        not use every axis.

    Returns
    -------
    float
        If the box has no area, so that almost no line meets it: as if each met all of it.
    """
    # Into [-1, 1] by an exact scale, so that areas neither overflow nor vanish.
    root = np.array(box, np.float64).ravel()
    _, exponent = np.frexp(np.abs(root).max())
    root = np.ldexp(root, -exponent)
    bounds = np.ldexp(np.asarray(bounds, order="C"), -exponent)

    x, y, z = root[3:] - root[:3]
    area = x * y + y * z + z * x
    if area == 0:
        return C_STEP * len(tree.children) + C_TRIANGLE * float((tree.children < 0).sum())
    nodes, leaves = _region_areas(*_arrays(tree), bounds, root)
    return float((C_STEP * nodes + C_TRIANGLE * leaves) / area)


def pose_cost(tree: Tree, vertices: np.ndarray, faces: np.ndarray) -> float:
    """SAH cost of a tree in one pose (V, 3) of its mesh."""
    used = vertices[faces]
    box = np.stack([used.min(axis=(0, 1)), used.max(axis=(0, 1))])
    return cost(tree, refit(tree, vertices, faces), box)


def _arrays(tree: Tree):
    """The arrays of a tree as compiled code takes them; one loaded from a file may differ."""
    children = np.require(tree.children, np.int32, ["C", "W"])
    return children, np.require(tree.axis, np.uint8, ["C", "W"])


@njit("float64[:, ::1](int32[:, ::1], uint8[::1], float64[:, ::1])", cache=True)
def _refit(children, axes, leaf_boxes):
    """Bounds of all nodes, bottom-up, from the boxes (T, 6) of the triangles."""
    bounds = np.empty((len(children), 4))
    node_boxes = np.empty((len(children), 6))
    for node in range(len(children) - 1, -1, -1):
        box, axis = node_boxes[node], axes[node]
        box[:3], box[3:] = np.inf, -np.inf
        for side in range(2):
            child = children[node, side]
            child_box = node_boxes[child] if child >= 0 else leaf_boxes[~child]
            bounds[node, 2 * side] = child_box[axis]
            bounds[node, 2 * side + 1] = child_box[axis + 3]
            for k in range(3):
                box[k] = min(box[k], child_box[k])
                box[k + 3] = max(box[k + 3], child_box[k + 3])
    return bounds


@njit
def _half_area(region):
    """Half the surface area of a region; none if it is empty."""
    x, y, z = region[3] - region[0], region[4] - region[1], region[5] - region[2]
    return x * y + y * z + z * x if min(x, y, z) >= 0 else 0.0


@njit("UniTuple(float64, 2)(int32[:, ::1], uint8[::1], float64[:, ::1], float64[::1])", cache=True)
def _region_areas(children, axes, bounds, root):
    """Sum of the half areas of all nodes' regions, and of all leaves'."""
    regions = np.empty((len(children), 6))
    regions[0] = root
    nodes = leaves = 0.0
    region = np.empty(6)
    for node in range(len(children)):
        nodes += _half_area(regions[node])
        axis = axes[node]
        for side in range(2):
            region[:] = regions[node]
            region[axis] = max(region[axis], bounds[node, 2 * side])
            region[axis + 3] = min(region[axis + 3], bounds[node, 2 * side + 1])
            child = children[node, side]
            if child >= 0:
                regions[child] = region
            else:
                leaves += _half_area(region)
    return nodes, leaves
