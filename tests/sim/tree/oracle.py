"""What sim.tree computes, again and slowly: from the definitions, with nothing shared."""

import numpy as np


def leaves(tree, child: int) -> list[int]:
    """Triangles below a child, as Tree names children."""
    if child < 0:
        return [~child]
    left, right = tree.children[child].tolist()
    return leaves(tree, left) + leaves(tree, right)


def box_of(corners):
    """Low and high of any number of triangles."""
    points = corners.reshape(-1, 3)
    return np.stack([points.min(axis=0), points.max(axis=0)])


def area(box) -> float:
    """Surface area of a box, face by face."""
    x, y, z = box[1] - box[0]
    return 2 * x * y + 2 * y * z + 2 * z * x


def clipped(region, box, axis: int):
    """A region between the bounds of a box on one axis."""
    region = region.copy()
    region[0, axis] = max(region[0, axis], box[0, axis])
    region[1, axis] = min(region[1, axis], box[1, axis])
    return region


def split_cost(corners, region, sides, axis: int, weight: float) -> float:
    """SAH cost of a node that bounds two lists of triangles on an axis."""
    total = 0.0
    for side in sides:
        box = box_of(corners[side])
        mean = (1 - weight) * area(box) + weight * area(clipped(region, box, axis))
        total += len(side) * mean
    return total


def all_partitions(corners, triangles: list[int]):
    """Every way to split the lists sorted by centre of mass: (left, right)."""
    centres = corners.mean(axis=1)
    for axis in range(3):
        order = sorted(triangles, key=lambda t, axis=axis: (centres[t, axis], t))
        for position in range(1, len(order)):
            yield order[:position], order[position:]


def traverse(tree, bounds, node: int, origins, directions, near, far):
    """Steps and triangle tests of every line below a node; near > far where it is not met."""
    met = near <= far
    steps, tests = met.astype(int), np.zeros(len(met), int)
    axis = tree.axis[node]
    for side, child in enumerate(tree.children[node].tolist()):
        low, high = bounds[node, 2 * side : 2 * side + 2]
        t0 = (low - origins[:, axis]) / directions[:, axis]
        t1 = (high - origins[:, axis]) / directions[:, axis]
        child_near = np.maximum(near, np.minimum(t0, t1))
        child_far = np.minimum(far, np.maximum(t0, t1))
        if child < 0:
            tests += met & (child_near <= child_far)
        else:
            below = traverse(tree, bounds, child, origins, directions, child_near, child_far)
            steps, tests = steps + below[0], tests + below[1]
    return steps, tests


def lines_through(rng, box, count: int):
    """Lines that meet a box, uniform among all lines: origins, directions, near, far.

    Uniform directions, and for each a uniform point of the disc across the box's bounding
    sphere; those that miss the box are left out, so fewer than `count` come back.
    """
    centre, radius = box.mean(axis=0), np.linalg.norm(box[1] - box[0]) / 2
    directions = rng.standard_normal((count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    across = np.cross(directions, rng.standard_normal((count, 3)))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    origins = centre + radius * np.sqrt(rng.random((count, 1))) * across

    t0, t1 = (box[0] - origins) / directions, (box[1] - origins) / directions
    near, far = np.minimum(t0, t1).max(axis=1), np.maximum(t0, t1).min(axis=1)
    met = near <= far
    return origins[met], directions[met], near[met], far[met]
