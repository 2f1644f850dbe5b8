"""Partial programs: on bounds of old vertices they come to what a refit of all would."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hdl.config import FULL, TINY, Config
from hdl.fp.format import FloatFormat
from sim.compiler.check import check
from sim.compiler.compile import compile_tree, place
from sim.compiler.image import Image
from sim.compiler.order import least_boxes
from sim.compiler.partial import Partial, corner_words, partial
from sim.cosim.machine import Machine, Timing
from sim.errors import InputError
from sim.model.fp.order import from_key, order_key
from sim.model.refit import refit
from sim.model.update import execute
from tests.sim.compiler.programs import take_apart
from tests.sim.compiler.trees import balanced, chain, random_tree, trees

CONFIGS = {
    "tiny": replace(TINY, box_registers=8),
    "full": FULL,
    "wide": Config(FloatFormat(8, 23), vertex_registers=3, latency=256),
}


def box_corners(fmt, part: Partial, corners: np.ndarray) -> np.ndarray:
    """What the host writes behind the image (2K, 3): the boxes of leaves (L, 3, 3)."""
    keys = order_key(fmt, corners).tolist()
    ends = np.zeros((2 * len(part.spans), 3), np.int64)
    for subtree, (first, end) in enumerate(part.spans.tolist()):
        points = [point for leaf in keys[first:end] for point in leaf]
        for axis in range(3):
            ends[2 * subtree, axis] = min(point[axis] for point in points)
            ends[2 * subtree + 1, axis] = max(point[axis] for point in points)
    return from_key(fmt, ends)


def assert_updates(image: Image, old, moved, now) -> Partial:
    """Run on bounds of the vertices before (V, 3), a program gives those of the vertices now.

    Both are bit patterns; moved (V,) says which of them are others.
    """
    config, fmt = image.config, image.config.fmt
    corners = image.vertices[image.corners]
    part = partial(image, moved[corners].any(axis=1))
    index = image.size - image.vertices_at
    check(config, part.instructions, index + 2 * len(part.spans), image.nodes, complete=False)

    records = np.zeros((index + 2 * len(part.spans), 3), np.int64)
    records[: len(image.vertices)] = now[image.vertices]
    records[index:] = box_corners(fmt, part, old[corners])
    stale = refit(fmt, image.order, old[corners])
    expected = refit(fmt, image.order, now[corners])
    assert (execute(config, part.instructions, records, stale) == expected).all()
    return part


def moving(rng, vertices: int, share: float, bits: int):
    """Patterns before and after, and which changed."""
    old = rng.integers(0, 1 << bits, (vertices, 3))
    moved = rng.random(vertices) < share
    return old, moved, np.where(moved[:, None], rng.integers(0, 1 << bits, (vertices, 3)), old)


@st.composite
def cases(draw):
    tree = draw(trees(most=24))
    triangles = int((~tree.children).max()) + 1
    vertices = draw(st.integers(1, 40))
    faces = draw(hnp.arrays(np.int32, (triangles, 3), elements=st.integers(0, vertices - 1)))
    config = CONFIGS[draw(st.sampled_from(sorted(CONFIGS)))]
    pattern = st.integers(0, (1 << config.fmt.bits) - 1)
    moved = draw(hnp.arrays(np.bool_, vertices))
    old, new = (draw(hnp.arrays(np.int64, (vertices, 3), elements=pattern)) for _ in range(2))
    return tree, faces, config, old, moved, np.where(moved[:, None], new, old)


@settings(max_examples=200, deadline=None)
@given(cases())
def test_any_tree_and_any_vertices(case):
    tree, faces, config, old, moved, now = case
    assert_updates(compile_tree(tree, faces, config), old, moved, now)


@pytest.mark.parametrize("config", CONFIGS.values(), ids=CONFIGS)
@pytest.mark.parametrize("share", [0.002, 0.05, 0.5, 1])
@pytest.mark.parametrize("shape", ["chain", "mirrored chain", "balanced", "random"])
def test_larger_trees(config, share, shape, rng):
    tree = {
        "chain": lambda: chain(128, leaf_left=True),
        "mirrored chain": lambda: chain(128, leaf_left=False),
        "balanced": lambda: balanced(7),
        "random": lambda: random_tree(rng, 128),
    }[shape]()
    image = compile_tree(tree, rng.integers(0, 300, (128, 3)).astype(np.int32), config)
    for _ in range(10):
        assert_updates(image, *moving(rng, 300, share, config.fmt.bits))


def test_exactly_as_many_boxes_as_the_order_needs(rng):
    for _ in range(20):
        tree = random_tree(rng, 200)
        faces = rng.integers(0, 150, (200, 3)).astype(np.int32)
        need = compile_tree(tree, faces, FULL).order.boxes
        image = compile_tree(tree, faces, replace(FULL, box_registers=need))
        assert_updates(image, *moving(rng, 150, 0.05, 24))


def test_no_more_boxes_than_what_moves_needs(rng):
    """A machine of two box registers updates one leaf of any tree; four leaves may need three."""
    for shape in (balanced(6), random_tree(rng, 64), chain(64, leaf_left=True)):
        faces = np.arange(192, dtype=np.int32).reshape(-1, 3)
        small = replace(FULL, box_registers=2)
        image = place(shape, faces, small, least_boxes(shape))
        moved = np.zeros(64, bool)
        moved[37] = True
        part = partial(image, moved)
        assert part.boxes <= 3
        if part.boxes == 2:
            index = image.size - image.vertices_at + 2 * len(part.spans)
            check(small, part.instructions, index, image.nodes, complete=False)
    image = place(balanced(6), faces, small, 7)
    with pytest.raises(InputError, match="what moves needs 7 .* box_registers is 2 .* be 7"):
        partial(image, np.ones(64, bool))


def test_nothing_moved():
    image = compile_tree(balanced(3), np.arange(24).reshape(8, 3), FULL)
    part = partial(image, np.zeros(8, bool))
    assert len(part.instructions) == 0
    assert not part.merged.any()
    assert part.spans.shape == (0, 2)


def test_everything_moved_is_the_whole_program(rng):
    faces = rng.integers(0, 60, (100, 3)).astype(np.int32)
    image = compile_tree(random_tree(rng, 100), faces, FULL)
    part = partial(image, np.ones(100, bool))
    assert part.merged.all()
    assert (part.instructions == image.instructions).all()


@pytest.mark.parametrize("levels", [2, 6, 11])
def test_one_leaf_costs_its_depth(levels):
    """Above it: a merge of each node, and of the box beside it; two jumps at most to each."""
    leaves = 1 << levels
    image = compile_tree(balanced(levels), np.arange(3 * leaves).reshape(-1, 3), FULL)
    moved = np.zeros(leaves, bool)
    moved[leaves // 3] = True
    part = partial(image, moved)
    names = [take_apart(word)[0] for word in part.instructions.tolist()]
    assert names.count("MERGE2") == levels
    assert names.count("MERGE3") == levels + 1  # two leaves, and what is beside each node above
    assert names.count("LOAD") == 2 * 3 + 2 * (levels - 1)
    assert names.count("NODE") <= levels
    assert len(part.spans) == levels - 1
    assert part.merged.sum() == 2


def test_no_room_for_the_boxes():
    """A scene that leaves less than 6 words of 64."""
    faces = np.arange(48).reshape(16, 3) % 18
    image = compile_tree(balanced(4), faces, replace(FULL, address_bits=6))
    with pytest.raises(InputError, match=f"{image.size + 6} memory words .* addresses 64"):
        partial(image, np.arange(16) == 0)


def test_in_the_verilog(rng):
    """Frame after frame, each with other vertices: the words of the nodes are those of a refit."""
    faces = rng.integers(0, 200, (150, 3)).astype(np.int32)
    image = compile_tree(random_tree(rng, 150), faces, FULL)
    corners = image.vertices[image.corners]
    now = rng.integers(0, 127 << 16, (200, 3))  # positive and finite
    with Machine(FULL, image.size + 2000, Timing(latency=20, stalls=0.2, seed=7)) as machine:
        machine.write(0, image.constant_words())
        machine.write(image.nodes_at, image.node_words(refit(FULL.fmt, image.order, now[corners])))
        for share in (0.02, 0.1, 0.3):
            old, moved = now, rng.random(200) < share
            now = np.where(moved[:, None], rng.integers(0, 127 << 16, (200, 3)), old)
            part = assert_updates(image, old, moved, now)
            program = np.zeros((-(-len(part.instructions) // 4), 4), np.uint32)
            program.reshape(-1)[: len(part.instructions)] = part.instructions
            boxes = corner_words(FULL.fmt, box_corners(FULL.fmt, part, old[corners]))
            at = image.size + len(boxes)
            machine.write(image.vertices_at, image.vertex_words(now))
            machine.write(image.size, boxes)
            machine.write(at, program)
            machine.update(at, len(part.instructions), image.vertices_at, image.nodes_at)
            bounds = refit(FULL.fmt, image.order, now[corners])
            assert (machine.read(image.nodes_at, image.nodes) == image.node_words(bounds)).all()
