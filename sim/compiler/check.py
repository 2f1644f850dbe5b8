"""Proves that a program is legal."""

import numba
import numpy as np

from hdl.config import Config
from hdl.isa import LAYOUTS, Opcode
from sim.compiler import fields
from sim.compiler.disassemble import disassemble
from sim.compiler.written import written_nodes


class IllegalProgram(ValueError):
    """A program that means nothing; names its first instruction that is at fault."""


def check(
    config: Config, instructions: np.ndarray, vertices: int, nodes: int, *, complete: bool = True
):
    """Prove that a program is legal on a machine and for a scene of so many vertices and nodes.

    Legal is: registers and indices exist, registers are written before they are read, an axis is
    x, y or z, unused bits are zero, and nodes are written in ascending order, so each at most
    once; if `complete`, each once.

    Parameters
    ----------
    config : Config
    instructions : (n,) uint32

    Raises
    ------
    IllegalProgram
    """
    words = np.asarray(instructions, np.uint32).reshape(-1, 1)
    opcodes = fields.get(words, LAYOUTS[Opcode.LOAD]["opcode"])

    faults: list[tuple[int, str]] = []

    def fault(rows, message):
        if len(rows):
            faults.append((int(rows[0]), message))

    used: dict[str, list] = {"v": [], "b": []}  # reads and writes of both kinds of register
    for opcode, layout in LAYOUTS.items():
        rows = np.flatnonzero(opcodes == opcode.value)
        part = words[rows]
        fault(rows[(part[:, 0].astype(np.int64) >> layout.size) != 0], "unused bits are not zero")
        for name, field in layout:
            value = fields.get(part, field)
            if name[0] in used and name != "vertex":
                kind = name[0]
                count = config.vertex_registers if kind == "v" else config.box_registers
                fault(rows[value >= count], f"there are {count} {kind} registers")
                writes = name in ("v", "b")
                used[kind].append((rows, value, writes))
            elif name == "vertex":
                fault(rows[value >= vertices], f"there are {vertices} vertices")
            elif name == "axis":
                fault(rows[value > 2], "an axis is x, y or z")

    for kind, uses in used.items():
        rows = np.concatenate([rows for rows, _, _ in uses])
        registers = np.concatenate([value for _, value, _ in uses])
        writes = np.concatenate([np.full(len(rows), write) for rows, _, write in uses])
        # In the order of instructions, reads of one before its write.
        order = np.lexsort((writes, rows))
        unwritten = _read_before_write(registers[order], writes[order])
        fault(rows[order][unwritten], f"reads a {kind} register that nothing has written")

    written, merges = written_nodes(instructions), np.flatnonzero(opcodes == Opcode.MERGE2.value)
    fault(merges[written >= nodes], f"there are {nodes} nodes")
    fault(merges[1:][np.diff(written) <= 0], "writes a node again or out of order")

    if faults:
        index, message = min(faults, key=lambda fault: fault[0])  # of one, what was found first
        line = next(disassemble(words[index]))
        raise IllegalProgram(f"instruction {index} ({line}): {message}")
    if complete and len(written) != nodes:
        missing = np.setdiff1d(np.arange(nodes), written)[0]
        raise IllegalProgram(f"the program writes {len(written)} of {nodes} nodes; not {missing}")


@numba.njit("int64[::1](int64[::1], boolean[::1])", cache=True)
def _read_before_write(registers, writes):
    """Indices of reads of a register that no write came before."""
    written = np.zeros(64, np.bool_)
    reads = np.empty(len(registers), np.int64)
    count = 0
    for index in range(len(registers)):
        if writes[index]:
            written[registers[index]] = True
        elif not written[registers[index]]:
            reads[count] = index
            count += 1
    return reads[:count].copy()
