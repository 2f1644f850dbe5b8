"""Which child of a node comes first, so that leaves that share vertices are near each other."""

import numba
import numpy as np

# Leaves back to which a vertex is taken to be in a register or worth keeping there. Loads a
# triangle of the elephant, a walker of 80k and waves of 80k: 0.540, 0.543, 0.538 with 100; 0.538,
# 0.541, 0.538 with 300; 0.536, 0.539, 0.536 with 1000 or 3000; 0.557, 0.561, 0.553 without this.
WINDOW = 1000

# Leaves of the largest subtree that is looked through, which keeps time linear. Above it the
# choice hardly matters.
LARGEST = 1 << 14


def sequence(
    children: np.ndarray, faces: np.ndarray, need: np.ndarray, leaves: np.ndarray, boxes: int
) -> tuple[np.ndarray, int]:
    """For each node whether its right child comes first, and the box registers that this needs.

    Greedy, from the first leaf to the last: of two children, the first is the one that shares
    more corners with the leaves just placed, and fewer with the subtree that follows both. It
    comes within 0.1 % of the loads of a local optimum. A leaf beside a node comes after it.

    Parameters
    ----------
    children : (N, 2) int32
        Of a Tree.
    faces : (T, 3) int32
    need, leaves : (N,) int32
        The fewest box registers for each subtree, and the number of its leaves.
    boxes : int
        Box registers that may be in use, at least need[0].

    Returns
    -------
    (N,) bool, int
    """
    begin, triangles = _spans(children, leaves)
    corners = faces[triangles]
    start, users = _users(corners, int(corners.max()) + 1)
    return _sequence(children, need, leaves, begin, corners, start, users, boxes)


@numba.njit("Tuple((int32[::1], int32[::1]))(int32[:, ::1], int32[::1])", cache=True)
def _spans(children, leaves):
    """The first leaf below each node when left comes first, and the triangles of all leaves."""
    begin = np.zeros(len(children), np.int32)
    triangles = np.empty(len(children) + 1, np.int32)
    for node in range(len(children)):  # parents come before children
        at = begin[node]
        for side in range(2):
            child = children[node, side]
            if child >= 0:
                begin[child] = at
                at += leaves[child]
            else:
                triangles[at] = ~child
                at += 1
    return begin, triangles


@numba.njit("Tuple((int32[::1], int32[::1]))(int32[:, ::1], int64)", cache=True)
def _users(corners, vertices):
    """The leaves that use vertex v are users[start[v] : start[v + 1]], ascending."""
    start = np.zeros(vertices + 2, np.int32)
    for vertex in corners.ravel():
        start[vertex + 2] += 1
    start = np.cumsum(start).astype(np.int32)
    users = np.empty(corners.size, np.int32)
    for leaf in range(len(corners)):
        for corner in range(3):
            vertex = corners[leaf, corner]
            users[start[vertex + 1]] = leaf
            start[vertex + 1] += 1
    return start[:-1].copy(), users


@numba.njit(cache=True)
def _used(users, low, high, span):
    """Whether one of the ascending users[low:high] lies in a span of leaves."""
    end = high
    while low < high:
        middle = (low + high) // 2
        if users[middle] < span[0]:
            low = middle + 1
        else:
            high = middle
    return low < end and users[low] < span[1]


@numba.njit(cache=True)
def _pull(corners, start, users, begin, end, after, last_use, now):
    """Corners of a span of leaves that were used just before, less those used by the next one."""
    pull = 0
    for leaf in range(begin, end):
        for corner in range(3):
            vertex = corners[leaf, corner]
            pull += last_use[vertex] >= now - WINDOW
            pull -= _used(users, start[vertex], start[vertex + 1], after)
    return pull


@numba.njit(
    "Tuple((boolean[::1], int64))(int32[:, ::1], int32[::1], int32[::1], int32[::1],"
    "int32[:, ::1], int32[::1], int32[::1], int64)",
    cache=True,
)
def _sequence(children, need, leaves, begin, corners, start, users, boxes):
    right_first = np.zeros(len(children), np.bool_)
    last_use = np.full(len(start), -WINDOW - 1, np.int64)  # leaf, by vertex
    now = 0  # leaves placed so far
    most = 0
    spans = np.empty((2, 2), np.int64)
    needs = np.empty(2, np.int64)
    pair = np.empty(2, np.int64)
    pull = np.empty(2, np.int64)
    # Subtrees to come: node or ~leaf, boxes it may use, span of the leaves that follow it.
    stack = np.empty((len(children) + 2, 4), np.int64)
    stack[0] = (0, boxes, 0, 0)
    depth = 1
    while depth:
        depth -= 1
        node, free = stack[depth, 0], stack[depth, 1]
        after = (stack[depth, 2], stack[depth, 3])
        if node < 0:
            for corner in range(3):
                last_use[corners[~node, corner]] = now
            now += 1
            most = max(most, boxes - free + 1)
            continue
        at = begin[node]
        for side in range(2):
            child = children[node, side]
            spans[side, 0] = at
            needs[side] = need[child] if child >= 0 else 1
            pair[side] = child if child >= 0 else ~at
            at += leaves[child] if child >= 0 else 1
            spans[side, 1] = at
        if (pair[0] < 0) != (pair[1] < 0):
            first = 1 if pair[0] < 0 else 0
        else:
            first = 1 if needs[1] > needs[0] else 0
            if leaves[node] <= LARGEST and max(needs[0], needs[1]) < free:  # either way will do
                for side in range(2):
                    begins, ends = spans[side]
                    pull[side] = _pull(corners, start, users, begins, ends, after, last_use, now)
                if pull[0] != pull[1]:
                    first = 1 if pull[1] > pull[0] else 0
        right_first[node] = first == 1
        second = 1 - first
        stack[depth] = (pair[second], free - 1, after[0], after[1])
        stack[depth + 1] = (pair[first], free, spans[second, 0], spans[second, 1])
        depth += 2
    return right_first, most
