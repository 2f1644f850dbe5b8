"""Model of hdl.update: an interpreter of instruction streams."""

import numba
import numpy as np

from hdl.config import Config
from hdl.isa import LAYOUTS, NODE_BITS, REGISTER_BITS, VERTEX_BITS, Opcode
from sim.model.fp.order import from_key, order_key

LOAD, MERGE3, MERGE2 = Opcode.LOAD.value, Opcode.MERGE3.value, Opcode.MERGE2.value
REGISTER = (1 << REGISTER_BITS) - 1
VERTEX = (1 << VERTEX_BITS) - 1
NODE = (1 << NODE_BITS) - 1
# Where the operands are. All register fields that have one name have one place.
V, VERTEX_AT = LAYOUTS[Opcode.LOAD]["v"].offset, LAYOUTS[Opcode.LOAD]["vertex"].offset
B = LAYOUTS[Opcode.MERGE3]["b"].offset
V0, V1, V2 = (LAYOUTS[Opcode.MERGE3][f].offset for f in ("v0", "v1", "v2"))
B0, B1, AXIS = (LAYOUTS[Opcode.MERGE2][f].offset for f in ("b0", "b1", "axis"))
NODE_AT = LAYOUTS[Opcode.NODE]["node"].offset


def execute(
    config: Config, instructions: np.ndarray, vertices: np.ndarray, bounds: np.ndarray
) -> np.ndarray:
    """The bounds of all nodes after a program, one instruction after the other.

    For legal programs (see sim.compiler.check): what a register holds before it is written, and
    what an index out of range does, is nobody's business.

    Parameters
    ----------
    config : Config
    instructions : (n,) uint32
    vertices : (V, 3) int64
        Bit patterns of the vertex records.
    bounds : (N, 4) int64
        Bit patterns of the bounds before the program; stays as it is.

    Returns
    -------
    (N, 4) int64 bit patterns
    """
    keys = _execute(
        np.ascontiguousarray(instructions, np.uint32),
        np.ascontiguousarray(order_key(config.fmt, vertices)),
        np.ascontiguousarray(order_key(config.fmt, bounds)),
    )
    return from_key(config.fmt, keys)


@numba.njit("int64[:, ::1](uint32[::1], int64[:, ::1], int64[:, ::1])", cache=True)
def _execute(instructions, vertices, bounds):
    bounds = bounds.copy()
    vertex = np.zeros((REGISTER + 1, 3), np.int64)
    lo = np.zeros((REGISTER + 1, 3), np.int64)
    hi = np.zeros((REGISTER + 1, 3), np.int64)
    node = 0
    for word in instructions:
        opcode = word & 3
        b = (word >> B) & REGISTER
        if opcode == LOAD:
            vertex[(word >> V) & REGISTER] = vertices[(word >> VERTEX_AT) & VERTEX]
        elif opcode == MERGE3:
            v0 = vertex[(word >> V0) & REGISTER]
            v1 = vertex[(word >> V1) & REGISTER]
            v2 = vertex[(word >> V2) & REGISTER]
            lo[b] = np.minimum(np.minimum(v0, v1), v2)
            hi[b] = np.maximum(np.maximum(v0, v1), v2)
        elif opcode == MERGE2:
            b0 = (word >> B0) & REGISTER
            b1 = (word >> B1) & REGISTER
            axis = (word >> AXIS) & 3
            bounds[node] = (lo[b0, axis], hi[b0, axis], lo[b1, axis], hi[b1, axis])
            lo[b], hi[b] = np.minimum(lo[b0], lo[b1]), np.maximum(hi[b0], hi[b1])
            node += 1
        else:
            node = (word >> NODE_AT) & NODE
    return bounds
