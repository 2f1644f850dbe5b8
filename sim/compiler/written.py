"""Which nodes a program writes."""

import numba
import numpy as np

from hdl.isa import LAYOUTS, Opcode
from sim.compiler import fields


def written_nodes(instructions: np.ndarray) -> np.ndarray:
    """The node that each MERGE2 of a program (n,) uint32 writes, one after the other."""
    words = np.asarray(instructions, np.uint32).reshape(-1, 1)
    opcodes = fields.get(words, LAYOUTS[Opcode.NODE]["opcode"])
    rows = np.flatnonzero(opcodes >= Opcode.MERGE2.value)
    targets = fields.get(words[rows], LAYOUTS[Opcode.NODE]["node"])
    return _nodes(opcodes[rows] == Opcode.NODE.value, targets)


@numba.njit("int64[::1](boolean[::1], int64[::1])", cache=True)
def _nodes(sets, targets):
    """The node that each merge writes, of a sequence of merges and of instructions that set it."""
    written = np.empty(len(sets), np.int64)
    count = node = 0
    for index in range(len(sets)):
        if sets[index]:
            node = targets[index]
        else:
            written[count] = node
            count += 1
            node += 1
    return written[:count].copy()
