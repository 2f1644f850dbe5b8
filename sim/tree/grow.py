"""Growing a tree top-down: sorted lists of triangles, split node by node.

All that is compiled stands in this one file, since numba's cache sees changes of a function's
own file only. `grow` has a signature: importing this module compiles it (seconds, once) or loads
it from the cache, and calling it never compiles.
"""

import numpy as np
from numba import njit

SAH, SPATIAL_MEDIAN, OBJECT_MEDIAN = range(3)

# Levels of nodes that no tree exceeds: time stays linear in triangles x levels where the least
# cost is a chain. Natural trees stay far from it: 18 levels for 12k triangles, 34 for 1M.
MAX_DEPTH = 64

# A node bounds a child on one axis, so rays enter its subtree as often as they meet the node's
# region clipped on that axis, and the subtree's lower nodes as rarely as they meet its tight box.
# A side is charged a mean of both areas, with this weight for the region. Against the tight box
# alone, the usual SAH, it takes 35 % off `sim.tree.cost.cost` of an elephant (38 % in motion),
# 46 % off that of a smooth closed mesh, 16 % off that of a soup. At rest all weights from 0.1 to
# 1 are within 4 % of each other; in motion a quarter was best of 0.1, 0.25, 0.5 and 0.75.
REGION_WEIGHT = 0.25

# Costs that differ by less (relative) differ by rounding alone.
TIE = 1e-12


@njit
def _enlarge(box, other):
    """Make `box` (low x, y, z, high x, y, z) hold `other`."""
    for k in range(3):
        box[k] = min(box[k], other[k])
        box[k + 3] = max(box[k + 3], other[k + 3])


@njit
def _side_cost(box, count, region, bounded):
    """SAH cost of `count` triangles in `box`, a child of a node with the extents `region`.

    `bounded` is the axis on which the node bounds the child. Areas are half surface areas.
    """
    x, y, z = box[3] - box[0], box[4] - box[1], box[5] - box[2]
    tight = x * y + y * z + z * x
    p, q = region[(bounded + 1) % 3], region[(bounded + 2) % 3]
    clipped = (box[bounded + 3] - box[bounded]) * (p + q) + p * q
    return count * ((1 - REGION_WEIGHT) * tight + REGION_WEIGHT * clipped)


@njit
def _sweep(order, boxes, regions, costs):
    """Costs of all partitions of one sorted list, into costs[axis that bounds, position].

    Summed over the poses: boxes are (P, T, 6), regions (P, 3).
    """
    count = len(order)
    costs[:, 1:count] = 0.0
    for pose in range(len(boxes)):
        region = regions[pose]
        box = boxes[pose, order[count - 1]].copy()
        for position in range(count - 1, 0, -1):
            _enlarge(box, boxes[pose, order[position]])
            for bounded in range(3):
                costs[bounded, position] += _side_cost(box, count - position, region, bounded)
        box[:] = boxes[pose, order[0]]
        for position in range(1, count):
            _enlarge(box, boxes[pose, order[position - 1]])
            for bounded in range(3):
                costs[bounded, position] += _side_cost(box, position, region, bounded)


@njit
def _least_cost(orders, begin, end, boxes, regions, costs, lowest, highest):
    """The partition of least cost: (list, axis that bounds, position).

    Of equal ones the most balanced: identical triangles then give a balanced tree, not a chain.
    """
    count = end - begin
    best = (0, 0, count // 2)
    least, least_imbalance = np.inf, count
    for sorted_list in range(len(orders)):
        _sweep(orders[sorted_list, begin:end], boxes, regions, costs)
        for bounded in range(3):
            for position in range(lowest, highest + 1):
                cost = costs[bounded, position]
                if cost > least * (1 + TIE):
                    continue
                imbalance = abs(count - 2 * position)
                if cost < least * (1 - TIE) or imbalance < least_imbalance:
                    best = (sorted_list, bounded, position)
                    least, least_imbalance = cost, imbalance
    return best


@njit
def _median(orders, begin, end, centroids, rule, lowest, highest):
    """Half of the space or of the triangles, on the longest axis: (axis, position)."""
    axis, longest = 0, -1.0
    for k in range(3):
        extent = centroids[orders[k, end - 1], k] - centroids[orders[k, begin], k]
        if extent > longest:
            axis, longest = k, extent
    if rule == SPATIAL_MEDIAN:
        order = orders[axis, begin:end]
        middle = 0.5 * (centroids[order[0], axis] + centroids[order[-1], axis])
        position = 0
        for triangle in order:
            position += centroids[triangle, axis] < middle
        if lowest <= position <= highest:
            return axis, position
    return axis, (end - begin) // 2


@njit
def _partition(orders, begin, end, chosen, middle, goes_left, right):
    """Partition all lists as the chosen one is at `middle`; each stays sorted."""
    for k in range(begin, end):
        goes_left[orders[chosen, k]] = k < middle
    for other in range(len(orders)):
        lefts, rights = begin, 0
        for k in range(begin, end):
            triangle = orders[other, k]
            if goes_left[triangle]:
                orders[other, lefts] = triangle
                lefts += 1
            else:
                right[rights] = triangle
                rights += 1
        orders[other, lefts:end] = right[:rights]


@njit
def _extent(order, boxes, axis):
    """Extent of some triangles' box on one axis."""
    low, high = np.inf, -np.inf
    for triangle in order:
        low = min(low, boxes[triangle, axis])
        high = max(high, boxes[triangle, axis + 3])
    return high - low


@njit(
    "Tuple((int32[:, ::1], uint8[::1]))"
    "(float64[:, :, ::1], float64[:, ::1], int32[:, ::1], int64, float64[:, ::1])",
    cache=True,
)
def grow(boxes, centroids, orders, rule, around):
    """Split until one triangle is left. Deterministic; time O(P x L x T x depth).

    Parameters
    ----------
    boxes : (P, T, 6) float64
        In each of P poses, low x, y, z, high x, y, z of each triangle, T >= 2. Squares must not
        overflow.
    centroids : (T, 3) float64
        Centre of mass of each triangle in the first pose: the medians are of that alone.
    orders : (L, T) int32
        Triangles in L sorted lists; the first three by centroid on each axis in the first pose.
        Overwritten.
    rule : int
        SAH, SPATIAL_MEDIAN or OBJECT_MEDIAN.
    around : (P, 3) float64
        Extents of the region that rays come through, in each pose; no less than those of the boxes.

    Returns
    -------
    children, axis
        As in Tree, in pre-order.
    """
    poses, triangles = boxes.shape[:2]
    children = np.empty((triangles - 1, 2), np.int32)
    axes = np.empty(triangles - 1, np.uint8)
    costs = np.empty((3, triangles if rule == SAH else 0))
    goes_left = np.empty(triangles, np.bool_)
    right = np.empty(triangles, np.int32)

    # Depth first: at most one right child a level waits, and one left child.
    stack = np.empty((MAX_DEPTH + 1, 5), np.int64)  # begin, end, levels left, parent, side
    regions = np.empty((MAX_DEPTH + 1, poses, 3))  # extents
    stack[0] = (0, triangles, MAX_DEPTH, -1, 0)
    regions[0] = around
    waiting = 1
    nodes = 0
    while waiting:
        waiting -= 1
        begin, end, levels, parent, side = stack[waiting]
        count = end - begin
        if parent >= 0:
            children[parent, side] = nodes if count > 1 else ~orders[0, begin]
        if count == 1:
            continue

        room = 1 << min(levels - 1, 40)  # triangles that fit below a child
        lowest, highest = max(1, count - room), min(count - 1, room)
        region = regions[waiting].copy()
        if rule == SAH:
            chosen, bounded, position = _least_cost(
                orders, begin, end, boxes, region, costs, lowest, highest
            )
        else:
            chosen, position = _median(orders, begin, end, centroids, rule, lowest, highest)
            bounded = chosen
        middle = begin + position
        _partition(orders, begin, end, chosen, middle, goes_left, right)

        axes[nodes] = bounded
        stack[waiting] = (middle, end, levels - 1, nodes, 1)
        stack[waiting + 1] = (begin, middle, levels - 1, nodes, 0)
        regions[waiting : waiting + 2] = region
        for pose in range(poses):
            of = boxes[pose]
            regions[waiting, pose, bounded] = _extent(orders[0, middle:end], of, bounded)
            regions[waiting + 1, pose, bounded] = _extent(orders[0, begin:middle], of, bounded)
        waiting += 2
        nodes += 1
    return children, axes
