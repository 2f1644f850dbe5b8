"""Instruction words from the table in hdl.isa, by hand, and random legal programs of them."""

import numpy as np
from hypothesis import strategies as st


def load(v: int, vertex: int) -> int:
    return 0 | v << 2 | vertex << 8


def merge3(b: int, v0: int, v1: int, v2: int) -> int:
    return 1 | b << 2 | v0 << 8 | v1 << 14 | v2 << 20


def merge2(b: int, b0: int, b1: int, axis: int) -> int:
    return 2 | b << 2 | b0 << 8 | b1 << 14 | axis << 20


def node(index: int) -> int:
    return 3 | index << 2


def take_apart(word: int) -> tuple[str, tuple[int, ...]]:
    """Name and operands of an instruction word."""
    name, widths = [
        ("LOAD", (6, 24)),
        ("MERGE3", (6, 6, 6, 6)),
        ("MERGE2", (6, 6, 6, 2)),
        ("NODE", (28,)),
    ][word % 4]
    word //= 4
    operands = []
    for width in widths:
        word, operand = divmod(word, 2**width)
        operands.append(operand)
    assert word == 0
    return name, tuple(operands)


def words_of(instructions: list[int]) -> np.ndarray:
    return np.array(instructions, np.uint32)


@st.composite
def programs(draw, vertex_registers: int, box_registers: int, vertices: int, nodes: int):
    """Legal programs that write some nodes or none; every register and operand takes part."""
    number = st.integers(0, (1 << 28) - 1)
    drawn = draw(st.lists(st.tuples(st.integers(0, 9), *[number] * 4), max_size=60))
    loaded, boxes, next_node, program = [], [], 0, []
    for kind, first, *operands in drawn:
        if not loaded or kind < 3:
            program.append(load(first % vertex_registers, operands[0] % vertices))
            loaded.append(first % vertex_registers)
        elif not boxes or kind < 6 or next_node == nodes:
            sources = [loaded[operand % len(loaded)] for operand in operands]
            program.append(merge3(first % box_registers, *sources))
            boxes.append(first % box_registers)
        elif kind < 9:
            b0, b1 = (boxes[operand % len(boxes)] for operand in operands[:2])
            program.append(merge2(first % box_registers, b0, b1, operands[2] % 3))
            boxes.append(first % box_registers)
            next_node += 1
        else:
            next_node += first % (nodes - next_node)
            program.append(node(next_node))
    return words_of(program)
