"""How long a program takes, if only its own order makes it wait."""

import numba
import numpy as np

from hdl.config import Config
from hdl.isa import LAYOUTS, Opcode
from sim.compiler import fields

LOAD, MERGE3, MERGE2 = Opcode.LOAD.value, Opcode.MERGE3.value, Opcode.MERGE2.value


def cycles(config: Config, instructions: np.ndarray) -> int:
    """Cycles from the first to the last issue of a program (n,) uint32.

    One instruction a cycle, in order, each when its registers are there. Beside it come the start,
    the last writes, and what waits for the memory port: some tens, a hundredth of what shares its
    vertices, and a fourteenth of triangles that share none.
    """
    words = np.asarray(instructions, np.uint32).reshape(-1, 1)
    opcode = fields.get(words, LAYOUTS[Opcode.LOAD]["opcode"])
    table = np.zeros((len(words), 4), np.int64)  # what it writes and reads, in this order
    for of, names in (
        (Opcode.LOAD, ("v",)),
        (Opcode.MERGE3, ("b", "v0", "v1", "v2")),
        (Opcode.MERGE2, ("b", "b0", "b1")),
    ):
        rows = np.flatnonzero(opcode == of.value)
        for column, name in enumerate(names):
            table[rows, column] = fields.get(words[rows], LAYOUTS[of][name])
    return int(_cycles(opcode, table, config.load_latency, config.box_latency))


@numba.njit("int64(int64[::1], int64[:, ::1], int64, int64)", cache=True)
def _cycles(opcode, table, load_latency, box_latency):
    vertex_ready = np.zeros(64, np.int64)
    box_ready = np.zeros(64, np.int64)
    cycle = 0
    for row in range(len(opcode)):
        written, a, b, c = table[row]
        if opcode[row] == LOAD:
            vertex_ready[written] = cycle + load_latency
        elif opcode[row] == MERGE3:
            ready = max(vertex_ready[a], vertex_ready[b], vertex_ready[c])
            cycle = max(cycle, ready)
            box_ready[written] = cycle + box_latency
        elif opcode[row] == MERGE2:
            cycle = max(cycle, box_ready[a], box_ready[b])
            box_ready[written] = cycle + box_latency
        cycle += 1
    return cycle
