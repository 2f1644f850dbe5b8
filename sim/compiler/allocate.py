"""Vertex registers: which vertices to load, when, and where to."""

from dataclasses import dataclass

import numba
import numpy as np

NEVER = np.int32(2**31 - 1)


@dataclass(frozen=True)
class Loads:
    """The loads of a stream, and the registers that its merges read.

    Attributes
    ----------
    vertex, register : (K,) int32
        What each load brings, and where to.
    leaf : (K,) int32
        The leaf whose merge needs it first. Loads are in this order.
    release : (K,) int32
        The last leaf that reads what the register held before, or -1: the load comes after it.
    operands : (L, 3) int32
        The registers of the three vertices of each leaf.
    """

    vertex: np.ndarray
    register: np.ndarray
    leaf: np.ndarray
    release: np.ndarray
    operands: np.ndarray


def allocate(corners: np.ndarray, registers: int, lead: int) -> Loads:
    """Loads for leaves that are merged in their order, in linear time.

    Of the registers that nothing has read for `lead` leaves, so that the load can be that much
    ahead of its merge, the one goes whose vertex is used again last (Belady 1966, with the uses
    to come known). Where there is none, the one that has been free longest.

    Parameters
    ----------
    corners : (L, 3) int32
        Vertices of each leaf. A vertex may come twice in one.
    registers : int
        At least 3.
    lead : int
        Leaves, at least 1.
    """
    corners = np.ascontiguousarray(corners, np.int32)
    vertices = int(corners.max()) + 1
    table, count, operands = _allocate(corners, vertices, registers, max(lead, 1))
    vertex, register, leaf, release = np.ascontiguousarray(table[:count].T)
    return Loads(vertex, register, leaf, release, operands)


@numba.njit("int32[:, ::1](int32[:, ::1], int64)", cache=True)
def _next_uses(corners, vertices):
    """For each corner, the next leaf that uses its vertex."""
    later = np.full(vertices, NEVER, np.int32)
    uses = np.empty_like(corners)
    for leaf in range(len(corners) - 1, -1, -1):
        for corner in range(3):
            uses[leaf, corner] = later[corners[leaf, corner]]
        for corner in range(3):
            later[corners[leaf, corner]] = leaf
    return uses


@numba.njit(cache=True)
def _victim(last_use, next_use, leaf, lead):
    """The register to load into."""
    best = -1
    for register in range(len(last_use)):
        if last_use[register] <= leaf - lead and (best < 0 or next_use[register] > next_use[best]):
            best = register
    if best < 0:
        best = np.argmin(last_use)
    return best


@numba.njit(
    "Tuple((int32[:, ::1], int64, int32[:, ::1]))(int32[:, ::1], int64, int64, int64)", cache=True
)
def _allocate(corners, vertices, registers, lead):
    uses = _next_uses(corners, vertices)
    holder = np.full(vertices, -1, np.int32)  # register of a vertex
    held = np.full(registers, -1, np.int32)  # vertex of a register
    last_use = np.full(registers, -lead, np.int32)
    next_use = np.full(registers, NEVER, np.int32)
    operands = np.empty_like(corners)
    loads = np.empty((corners.size, 4), np.int32)
    count = 0
    for leaf in range(len(corners)):
        for corner in range(3):  # what is there stays, before anything makes room
            register = holder[corners[leaf, corner]]
            if register >= 0:
                last_use[register] = leaf
        for corner in range(3):
            vertex = corners[leaf, corner]
            if holder[vertex] < 0:
                register = _victim(last_use, next_use, leaf, lead)
                if held[register] >= 0:
                    holder[held[register]] = -1
                loads[count, 0] = vertex
                loads[count, 1] = register
                loads[count, 2] = leaf
                loads[count, 3] = max(last_use[register], -1)
                count += 1
                holder[vertex] = register
                held[register] = vertex
                last_use[register] = leaf
            operands[leaf, corner] = holder[vertex]
        for corner in range(3):
            next_use[operands[leaf, corner]] = uses[leaf, corner]
    return loads, count, operands
