"""sim.model.update against an interpreter that shares nothing with it but the table in hdl.isa."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hdl.config import FULL, TINY, Config
from hdl.fp.format import FloatFormat
from sim.model.refit import refit
from sim.model.update import execute
from sim.prepare import prepare
from sim.scene.load import load_scene
from tests import oracle
from tests.sim.compiler.programs import (
    load,
    merge2,
    merge3,
    node,
    programs,
    take_apart,
    words_of,
)

CONFIGS = {"tiny": TINY, "full": FULL, "wide": Config(FloatFormat(8, 23))}


def interpret(fmt, program, vertices, bounds):
    """Bounds after a program: one instruction after the other, on lists of patterns."""
    vertex, box = {}, {}  # registers; a box is (low, high) on each axis
    bounds = [list(row) for row in bounds]
    at = 0
    for word in program:
        name, operands = take_apart(word)
        if name == "LOAD":
            vertex[operands[0]] = vertices[operands[1]]
        elif name == "MERGE3":
            corners = zip(*(vertex[v] for v in operands[1:]), strict=True)
            box[operands[0]] = [(oracle.low(fmt, *c), oracle.high(fmt, *c)) for c in corners]
        elif name == "MERGE2":
            b, b0, b1, axis = operands
            bounds[at] = [*box[b0][axis], *box[b1][axis]]
            box[b] = [
                (oracle.low(fmt, low0, low1), oracle.high(fmt, high0, high1))
                for (low0, high0), (low1, high1) in zip(box[b0], box[b1], strict=True)
            ]
            at += 1
        else:
            at = operands[0]
    return bounds


@st.composite
def cases(draw):
    """A config, a legal program, and any patterns at all in vertices and bounds."""
    config = CONFIGS[draw(st.sampled_from(sorted(CONFIGS)))]
    vertices, nodes = draw(st.integers(1, 12)), draw(st.integers(1, 8))
    program = draw(programs(config.vertex_registers, config.box_registers, vertices, nodes))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    top = 1 << config.fmt.bits
    return config, program, rng.integers(0, top, (vertices, 3)), rng.integers(0, top, (nodes, 4))


@settings(max_examples=300, deadline=None)
@given(cases())
def test_any_legal_program(case):
    config, program, vertices, bounds = case
    before = bounds.copy()
    found = execute(config, program, vertices, bounds)
    expected = interpret(config.fmt, program.tolist(), vertices.tolist(), bounds.tolist())
    assert found.tolist() == expected
    assert (bounds == before).all(), "the bounds before the program were changed"


@settings(max_examples=100, deadline=None)
@given(hnp.arrays(np.int64, (5, 3), elements=st.integers(0, 63)))
def test_all_registers_are_apart(vertices):
    """Every register of both kinds is written before the first is read."""
    program = [load(v, v % 5) for v in range(64)]
    program += [merge3(b, b, (b + 1) % 64, (b + 20) % 64) for b in range(64)]
    program += [merge2(63 - b, b, (b + 32) % 64, b % 3) for b in range(32)]
    bounds = np.zeros((32, 4), np.int64)
    config = Config(TINY.fmt)
    found = execute(config, words_of(program), vertices, bounds)
    assert found.tolist() == interpret(config.fmt, program, vertices.tolist(), bounds.tolist())


def test_result_may_be_an_operand():
    fmt = TINY.fmt
    vertices = [[0, 1, 2], [3, 4, 5], [6, 7, 8]]
    program = [load(v, v) for v in range(3)]
    program += [merge3(0, 0, 0, 0), merge3(1, 1, 1, 1), merge3(2, 2, 2, 2)]
    program += [merge2(1, 0, 1, 0), merge2(2, 1, 2, 1), merge2(2, 2, 2, 2)]
    found = execute(TINY, words_of(program), np.array(vertices), np.zeros((3, 4), np.int64))
    assert found.tolist() == [[0, 0, 3, 3], [1, 4, 7, 7], [2, 8, 2, 8]]
    assert interpret(fmt, program, vertices, [[0] * 4] * 3) == found.tolist()


def test_nodes_that_are_not_written_stay(rng):
    """Every pattern survives, canonical or not."""
    bounds = np.arange(64).reshape(16, 4)
    program = [load(0, 0), merge3(0, 0, 0, 0), node(7), merge2(0, 0, 0, 1), node(12)]
    found = execute(TINY, words_of(program), np.array([[9, 9, 9]]), bounds)
    bounds[7] = 9
    assert found.tolist() == bounds.tolist()


def test_empty_program():
    bounds = np.array([[1, 2, 3, 4]])
    assert execute(TINY, words_of([]), np.array([[0, 0, 0]]), bounds).tolist() == bounds.tolist()


def test_accepts_other_types_and_strides():
    program = words_of([load(0, 1), merge3(0, 0, 0, 0), merge2(0, 0, 0, 2)])
    vertices = np.asfortranarray(np.arange(12).reshape(4, 3))
    bounds = np.zeros((2, 8), np.int64)[:, ::2]
    found = execute(TINY, program, vertices[::2], bounds)
    assert found.tolist() == [[8, 8, 8, 8], [0, 0, 0, 0]]
    assert execute(TINY, program.astype(np.int64), vertices[::2], bounds).tolist() == found.tolist()


@pytest.fixture
def elephant(scene_file):
    return prepare(load_scene(str(scene_file("elephant.npz"))), FULL)


def test_no_drift(elephant):
    """All frames on the same memory and back again: each time the very same bits."""
    image = elephant.image
    bounds = np.full((image.nodes, 4), (1 << FULL.fmt.bits) - 1)
    forward = {}
    for frame in elephant.frames:
        vertices = elephant.coordinates(frame)
        bounds = execute(FULL, image.instructions, vertices[image.vertices], bounds)
        assert (bounds == refit(FULL.fmt, image.order, vertices[elephant.leaf_vertices])).all()
        forward[frame] = bounds
    assert (forward[0] != forward[elephant.frames[-1]]).any()
    for frame in reversed(elephant.frames):
        vertices = elephant.coordinates(frame)
        bounds = execute(FULL, image.instructions, vertices[image.vertices], bounds)
        assert (bounds == forward[frame]).all(), f"frame {frame} on the way back"
