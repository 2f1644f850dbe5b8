"""Bounds of all nodes from the tree alone: what any update program has to come to."""

import numba
import numpy as np

from hdl.fp.format import FloatFormat
from sim.compiler.order import Order
from sim.model.fp.order import from_key, maximum, minimum, order_key


def refit(fmt: FloatFormat, order: Order, corners: np.ndarray) -> np.ndarray:
    """Bounds (left lo, left hi, right lo, right hi) of each node on its axis, bottom-up.

    Exact: no operation rounds. (Woop, Marmitt, Slusallek 2006, update of B-KD trees.)

    Parameters
    ----------
    fmt : FloatFormat
    order : Order
    corners : (L, 3 corners, 3 axes) int64
        Bit patterns of the vertices of each leaf.

    Returns
    -------
    (N, 4) int64 bit patterns
    """
    v0, v1, v2 = corners[:, 0], corners[:, 1], corners[:, 2]
    lo = minimum(fmt, minimum(fmt, v0, v1), v2)
    hi = maximum(fmt, maximum(fmt, v0, v1), v2)
    keys = _refit(order.children, order.axis, order_key(fmt, lo), order_key(fmt, hi))
    return from_key(fmt, keys)


def box_corners(fmt: FloatFormat, corners: np.ndarray, spans: np.ndarray) -> np.ndarray:
    """Lowest and highest corner of each span (K, 2) of leaves (L, 3, 3): (2K, 3) patterns."""
    keys = order_key(fmt, corners)
    ends = np.empty((2 * len(spans), 3), np.int64)
    for row, (first, end) in enumerate(spans.tolist()):
        ends[2 * row] = keys[first:end].min(axis=(0, 1))
        ends[2 * row + 1] = keys[first:end].max(axis=(0, 1))
    return from_key(fmt, ends)


@numba.njit("int64[:, ::1](int32[:, ::1], uint8[::1], int64[:, ::1], int64[:, ::1])", cache=True)
def _refit(children, axis, leaf_lo, leaf_hi):
    nodes, leaves = len(children), len(leaf_lo)
    bounds = np.empty((nodes, 4), np.int64)
    lo = np.empty((leaves + nodes, 3), np.int64)  # boxes of leaves, then of nodes
    hi = np.empty((leaves + nodes, 3), np.int64)
    lo[:leaves] = leaf_lo
    hi[:leaves] = leaf_hi
    for node in range(nodes):
        left, right = children[node, 0], children[node, 1]
        left = ~left if left < 0 else leaves + left
        right = ~right if right < 0 else leaves + right
        a = axis[node]
        bounds[node] = (lo[left, a], hi[left, a], lo[right, a], hi[right, a])
        lo[leaves + node] = np.minimum(lo[left], lo[right])
        hi[leaves + node] = np.maximum(hi[left], hi[right])
    return bounds
