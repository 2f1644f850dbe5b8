"""sim.compiler.check: legal programs pass, and of others the first bad instruction is named."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdl.config import FULL, TINY
from sim.compiler.check import IllegalProgram, check
from sim.compiler.disassemble import assemble, disassemble
from tests.sim.compiler.programs import programs, words_of

VERTICES, NODES = 6, 3
LEGAL = [
    "LOAD   v0, 0",
    "LOAD   v1, 5",
    "LOAD   v4, 2",
    "MERGE3 b0, v0, v1, v4",
    "MERGE3 b1, v1, v1, v4",
    "MERGE2 b2, b0, b1, z",
    "LOAD   v0, 3",
    "MERGE3 b3, v0, v1, v4",
    "MERGE2 b2, b2, b3, x",
    "NODE   2",
    "MERGE2 b3, b3, b2, y",
]


def assert_refused(words, index, message, config=TINY, complete=True):
    with pytest.raises(IllegalProgram) as caught:
        check(config, words, VERTICES, NODES, complete=complete)
    if index is None:
        assert message in str(caught.value)
    else:
        line = next(disassemble(words[index : index + 1]))
        assert str(caught.value) == f"instruction {index} ({line}): {message}"


def test_legal():
    check(TINY, assemble(LEGAL), VERTICES, NODES)
    check(FULL, assemble(LEGAL), VERTICES, NODES)


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_legal_programs_pass(data):
    vertices, nodes = data.draw(st.integers(1, 9)), data.draw(st.integers(1, 9))
    program = data.draw(programs(TINY.vertex_registers, TINY.box_registers, vertices, nodes))
    check(TINY, program, vertices, nodes, complete=False)


V_UNWRITTEN = "reads a v register that nothing has written"
B_UNWRITTEN = "reads a b register that nothing has written"


@pytest.mark.parametrize(
    ("index", "line", "message"),
    [
        (3, "MERGE3 b0, v2, v1, v4", V_UNWRITTEN),
        (3, "MERGE3 b0, v0, v3, v4", V_UNWRITTEN),
        (3, "MERGE3 b0, v0, v1, v2", V_UNWRITTEN),
        (5, "MERGE2 b2, b3, b1, z", B_UNWRITTEN),
        (5, "MERGE2 b2, b0, b2, z", B_UNWRITTEN),  # its own result does not count
        (0, "LOAD   v5, 0", "there are 5 v registers"),
        (4, "MERGE3 b1, v63, v1, v4", "there are 5 v registers"),
        (4, "MERGE3 b1, v1, v5, v4", "there are 5 v registers"),
        (4, "MERGE3 b1, v1, v1, v5", "there are 5 v registers"),
        (4, "MERGE3 b4, v1, v1, v4", "there are 4 b registers"),
        (8, "MERGE2 b4, b2, b3, x", "there are 4 b registers"),
        (8, "MERGE2 b2, b4, b3, x", "there are 4 b registers"),
        (8, "MERGE2 b2, b2, b63, x", "there are 4 b registers"),
        (6, "LOAD   v0, 6", "there are 6 vertices"),
        (6, "LOAD   v0, 16777215", "there are 6 vertices"),
        (5, "MERGE2 b2, b0, b1, ?", "an axis is x, y or z"),
    ],
)
def test_one_bad_instruction(index, line, message):
    lines = LEGAL.copy()
    lines[index] = line
    assert_refused(assemble(lines), index, message)


@pytest.mark.parametrize(
    ("target", "index", "message"),
    [
        (3, 10, "there are 3 nodes"),
        (2**28 - 1, 10, "there are 3 nodes"),
        (1, 10, "writes a node again or out of order"),
        (0, 10, "writes a node again or out of order"),
    ],
)
def test_bad_node(target, index, message):
    lines = LEGAL.copy()
    lines[9] = f"NODE   {target}"
    assert_refused(assemble(lines), index, message)
    assert_refused(assemble(lines), index, message, complete=False)


def test_one_node_too_many():
    words = assemble([*LEGAL, "MERGE2 b0, b0, b1, x"])
    assert_refused(words, len(LEGAL), "there are 3 nodes")


@pytest.mark.parametrize(
    ("start", "missing"),
    [("NODE   0", None), ("NODE   1", 0)],
)
def test_missing_nodes(start, missing):
    two = [start, *LEGAL[:9]]
    expected = f"the program writes 2 of 3 nodes; not {2 if missing is None else missing}"
    assert_refused(assemble(two), None, expected)
    check(TINY, assemble(two), VERTICES, NODES, complete=False)


def test_empty_program():
    assert_refused(words_of([]), None, "the program writes 0 of 3 nodes; not 0")
    check(TINY, words_of([]), VERTICES, NODES, complete=False)


@pytest.mark.parametrize(("index", "lowest"), [(3, 26), (7, 26), (5, 22), (8, 22), (9, 30)])
def test_unused_bits(index, lowest):
    for bit in range(lowest, 32):
        words = assemble(LEGAL)
        words[index] |= np.uint32(1 << bit)
        assert_refused(words, index, "unused bits are not zero")


def test_the_first_of_several_is_named():
    lines = LEGAL.copy()
    lines[8] = "MERGE2 b2, b2, b3, ?"
    lines[6] = "LOAD   v0, 6"
    lines[7] = "MERGE3 b4, v0, v1, v4"
    assert_refused(assemble(lines), 6, "there are 6 vertices")


@settings(max_examples=100, deadline=None)
@given(st.integers(0, len(LEGAL) - 1), st.integers(0, 31))
def test_any_flipped_bit_is_refused_in_one_line_or_legal(index, bit):
    """Nothing but IllegalProgram ever comes of a program."""
    words = assemble(LEGAL)
    words[index] ^= np.uint32(1 << bit)
    try:
        check(TINY, words, VERTICES, NODES)
    except IllegalProgram as error:
        assert re.match(r"(instruction \d+ \(.*\)|the program writes .*): ?", f"{error}: ")
        assert "\n" not in str(error)


@pytest.mark.parametrize("index", range(len(LEGAL)))
def test_every_instruction_of_it_is_needed(index):
    """Without any one of them (the second load of v0 apart) the program is no longer legal."""
    lines = LEGAL[:index] + LEGAL[index + 1 :]
    if index in (6, 9):  # v0 still holds a vertex; the next node is 2 anyway
        check(TINY, assemble(lines), VERTICES, NODES)
    else:
        with pytest.raises(IllegalProgram):
            check(TINY, assemble(lines), VERTICES, NODES)
