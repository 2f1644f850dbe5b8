"""sim.compiler.disassemble and the fields it reads: words to text and back."""

import numpy as np
import pytest
from amaranth.lib import data
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.compiler import fields
from sim.compiler.disassemble import assemble, disassemble
from tests.sim.compiler.programs import load, merge2, merge3, node, take_apart, words_of

REGISTER = st.integers(0, 63)
INSTRUCTIONS = st.one_of(
    st.builds(load, REGISTER, st.integers(0, 2**24 - 1)),
    st.builds(merge3, REGISTER, REGISTER, REGISTER, REGISTER),
    st.builds(merge2, REGISTER, REGISTER, REGISTER, st.integers(0, 3)),
    st.builds(node, st.integers(0, 2**28 - 1)),
)
BY_HAND = {
    load(63, 2**24 - 1): "LOAD   v63, 16777215",
    load(5, 9): "LOAD   v5, 9",
    merge3(1, 2, 3, 4): "MERGE3 b1, v2, v3, v4",
    merge2(1, 2, 3, 0): "MERGE2 b1, b2, b3, x",
    merge2(63, 0, 62, 1): "MERGE2 b63, b0, b62, y",
    merge2(0, 0, 0, 2): "MERGE2 b0, b0, b0, z",
    merge2(0, 0, 0, 3): "MERGE2 b0, b0, b0, ?",
    node(2**28 - 1): "NODE   268435455",
}


@settings(max_examples=200, deadline=None)
@given(st.lists(INSTRUCTIONS, max_size=30))
def test_there_and_back(program):
    lines = list(disassemble(words_of(program)))
    assert assemble(lines).tolist() == program
    for line, word in zip(lines, program, strict=True):
        name, operands = take_apart(word)
        told = line.replace(",", " ").replace("v", "").replace("b", "").split()
        shown = [str(operand) for operand in operands]
        if name == "MERGE2":
            shown[3] = "xyz?"[operands[3]]
        assert told == [name, *shown]


def test_text_of_each_instruction():
    assert list(disassemble(words_of(list(BY_HAND)))) == list(BY_HAND.values())
    assert assemble(BY_HAND.values()).tolist() == list(BY_HAND)


def test_nothing():
    assert list(disassemble(words_of([]))) == []
    assert assemble([]).tolist() == []


@pytest.mark.parametrize(
    "line",
    [
        "LOAD v64, 0",
        "LOAD v0, 16777216",
        "LOAD v0, -1",
        "MERGE3 b0, v0, v0, v64",
        "NODE 268435456",
        "MERGE2 b0, b0, b0, w",
        "LOAD v0",
        "LOAD v0, 1, 2",
    ],
)
def test_assemble_refuses_what_does_not_fit(line):
    with pytest.raises(ValueError):
        assemble([line])


@settings(max_examples=200, deadline=None)
@given(st.integers(1, 32), st.integers(0, 96), st.integers(0, 31), st.data())
def test_put_and_get_touch_their_field_only(width, offset, base, data_):
    """Against slices of Python's integers, over the borders of limbs."""
    field = data.Field(width, offset)
    values = data_.draw(st.lists(st.integers(0, 2**width - 1), min_size=1, max_size=4))
    words = np.zeros((len(values), 5), np.uint32)
    words[:] = 0xFFFF_FFFF
    mask = ~(((1 << width) - 1) << offset + base) & (1 << 160) - 1
    words &= np.array([mask >> 32 * limb & 0xFFFF_FFFF for limb in range(5)], np.uint32)
    fields.put(words, field, values, base)
    for word, value in zip(words.tolist(), values, strict=True):
        assert sum(limb << 32 * k for k, limb in enumerate(word)) == mask | value << offset + base
    assert fields.get(words, field, base).tolist() == values
    assert fields.get(words, field, base).dtype == np.int64


@pytest.mark.parametrize("width", [1, 6, 31, 32])
def test_put_refuses_what_does_not_fit(width):
    for wrong in (-1, 2**width, -(2**40), 2**40):
        words = np.zeros((2, 2), np.uint32)
        with pytest.raises(ValueError, match=f"{width} bits do not hold {min(0, wrong)} to"):
            fields.put(words, data.Field(width, 3), [0, wrong])
        assert not words.any()
    fields.put(np.zeros((0, 1), np.uint32), data.Field(width, 0), [])
