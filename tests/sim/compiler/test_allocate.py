"""sim.compiler.allocate: loads that may be hoisted as told, and as few as there can be."""

import itertools

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sim.compiler.allocate import allocate


@st.composite
def leaves(draw, vertices: int, most: int):
    """Corners of leaves over few vertices; two or three of a leaf may be one."""
    count = draw(st.integers(1, vertices))
    corner = st.integers(0, count - 1)
    return np.array(draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=most)))


def assert_sound(corners, loads, registers: int):
    """Every merge reads its vertices, whenever the loads run that may run; and as documented."""
    assert loads.operands.shape == corners.shape
    assert 0 <= loads.register.min() and loads.register.max() < registers
    assert 0 <= loads.operands.min() and loads.operands.max() < registers
    assert (np.diff(loads.leaf) >= 0).all()
    assert (loads.release < loads.leaf).all() and loads.release.min() >= -1
    table = list(zip(*(a.tolist() for a in (loads.vertex, loads.register)), strict=True))
    for due in (loads.leaf, loads.release + 1):  # as late and as early as a load may be
        due = np.maximum.accumulate(due).tolist()  # in their order
        held, load, last_read = {}, 0, {}
        for leaf, triangle in enumerate(corners.tolist()):
            while load < len(table) and due[load] <= leaf:
                vertex, register = table[load]
                assert last_read.get(register, -1) == loads.release[load], f"load {load}"
                held[register] = vertex
                load += 1
            for vertex, register in zip(triangle, loads.operands[leaf].tolist(), strict=True):
                assert held.get(register) == vertex, f"leaf {leaf} reads register {register}"
                last_read[register] = leaf
        assert load == len(table)
    first_need = {}
    for load, leaf in enumerate(loads.leaf.tolist()):
        assert loads.vertex[load] in corners[leaf], f"load {load} is for no corner of its leaf"
        first_need.setdefault((leaf, int(loads.vertex[load])), load)
    assert len(first_need) == len(table), "a vertex is loaded twice for one leaf"


def assert_waits_as_long_as_it_can(corners, loads, registers: int, lead: int):
    """A load closer than `lead` to the last read of its register: all were read as late."""
    last_read = np.full(registers, -lead)
    load = 0
    for leaf in range(len(corners)):
        here = slice(load, load + int((loads.leaf == leaf).sum()))
        load = here.stop
        kept = set(loads.operands[leaf].tolist()) - set(loads.register[here].tolist())
        last_read[list(kept)] = leaf
        for register, release in zip(loads.register[here], loads.release[here], strict=True):
            if release > max(leaf - lead, -1):
                assert release == last_read.min(), f"leaf {leaf}"
            last_read[register] = leaf


def fewest_loads(corners, registers: int) -> int:
    """The optimum over everything that could be kept, by search."""
    costs = {frozenset(): 0}
    for triangle in corners.tolist():
        needed = frozenset(triangle)
        after = {}
        for held, cost in costs.items():
            spare = held - needed
            cost += len(needed - held)
            for kept in itertools.combinations(spare, min(len(spare), registers - len(needed))):
                state = needed | frozenset(kept)
                after[state] = min(cost, after.get(state, cost))
        costs = after
    return min(costs.values())


@settings(max_examples=200, deadline=None)
@given(leaves(vertices=12, most=40), st.integers(3, 8), st.integers(1, 6))
@example(np.array([[0, 0, 0]]), 3, 1)
@example(np.array([[0, 0, 1], [1, 2, 2], [3, 3, 3], [0, 1, 2]]), 3, 2)
def test_any_leaves(corners, registers, lead):
    loads = allocate(corners, registers, lead)
    assert_sound(corners, loads, registers)
    assert_waits_as_long_as_it_can(corners, loads, registers, lead)


@settings(max_examples=200, deadline=None)
@given(leaves(vertices=8, most=14), st.integers(3, 6))
def test_as_few_loads_as_there_can_be(corners, registers):
    assert len(allocate(corners, registers, 1).vertex) == fewest_loads(corners, registers)


@pytest.mark.parametrize("lead", [1, 20])
def test_large(rng, lead):
    """Leaves that use near vertices, as those of a tree do."""
    corners = np.arange(20_000)[:, None] // 2 + rng.integers(0, 100, (20_000, 3))
    loads = allocate(corners, 64, lead)
    assert_sound(corners, loads, 64)
    assert_waits_as_long_as_it_can(corners, loads, 64, lead)
    assert len(loads.vertex) >= len(np.unique(corners))


def test_each_vertex_once_where_registers_suffice(rng):
    corners = rng.integers(0, 64, (500, 3))
    loads = allocate(corners, 64, 20)
    assert sorted(loads.vertex.tolist()) == sorted(set(corners.ravel().tolist()))
    assert (loads.release == -1).all()


def test_duplicates_take_one_register():
    loads = allocate(np.array([[7, 7, 7], [7, 3, 7]]), 3, 1)
    assert loads.vertex.tolist() == [7, 3]
    assert len(set(loads.operands[0].tolist())) == 1
    assert loads.operands[1, 0] == loads.operands[1, 2] == loads.operands[0, 0]
    assert loads.operands[1, 1] != loads.operands[1, 0]


def test_throws_out_what_is_used_last():
    """By hand: with three registers, vertex 2 is not used again before 0 and 1 are."""
    corners = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 3], [2, 2, 2]])
    loads = allocate(corners, 3, 1)
    assert loads.vertex.tolist() == [0, 1, 2, 3, 2]
    assert loads.leaf.tolist() == [0, 0, 0, 1, 3]
    assert loads.release.tolist()[:4] == [-1, -1, -1, 0]
    assert loads.register[3] == loads.operands[0, 2]
