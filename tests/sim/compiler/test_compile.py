"""The whole compiler: every program is legal, comes to what the tree is, and loads little."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hdl.config import FULL, TINY, Config
from hdl.fp.format import FloatFormat
from sim.compiler import compile as compiler
from sim.compiler.check import check
from sim.compiler.compile import compile_tree
from sim.errors import InputError
from sim.model.refit import refit
from sim.model.update import execute
from sim.scene.load import load_scene
from sim.tree.build import build
from sim.tree.tree import Tree
from tests.sim.compiler.programs import take_apart
from tests.sim.compiler.trees import (
    balanced,
    chain,
    icosphere,
    leaves_below,
    needs,
    random_tree,
    trees,
)

WIDE = Config(FloatFormat(8, 23), vertex_registers=3, box_registers=64, latency=256)
CONFIGS = {
    "tiny": replace(TINY, box_registers=8),
    "full": FULL,
    "three vertex registers": WIDE,
    "no latency": replace(FULL, latency=1, vertex_registers=6),
}


def assert_right(tree, faces, config, bits):
    """Legal, bounded, no record is lost, and two ways to the bounds agree on every bit."""
    image = compile_tree(tree, faces, config)
    check(config, image.instructions, len(image.vertices), image.nodes)

    assert sorted(image.vertices.tolist()) == np.unique(faces).tolist()
    assert (image.vertices[image.corners] == faces[image.order.triangles]).all()
    names = [take_apart(word)[0] for word in image.instructions.tolist()]
    assert names.count("MERGE2") == image.nodes
    assert names.count("MERGE3") == len(image.corners)
    assert names.count("NODE") == 0
    assert names.count("LOAD") >= len(image.vertices)

    bounds = execute(config, image.instructions, bits[image.vertices], stale(config, image))
    expected = refit(config.fmt, image.order, bits[faces[image.order.triangles]])
    assert (bounds == expected).all(), f"nodes {np.flatnonzero((bounds != expected).any(axis=1))}"
    return image


def stale(config, image):
    """Bounds that a program has to overwrite, all of them."""
    return np.full((image.nodes, 4), (1 << config.fmt.bits) - 1)


def loads_per_triangle(image) -> float:
    return sum(take_apart(word)[0] == "LOAD" for word in image.instructions.tolist()) / len(
        image.corners
    )


@st.composite
def cases(draw):
    """A tree over few vertices: duplicates and degenerate triangles are the rule."""
    tree = draw(trees(most=24))
    triangles = int((~tree.children).max()) + 1
    vertices = draw(st.integers(1, 20))
    faces = draw(hnp.arrays(np.int32, (triangles, 3), elements=st.integers(0, vertices - 1)))
    config = CONFIGS[draw(st.sampled_from(sorted(CONFIGS)))]
    pattern = st.integers(0, (1 << config.fmt.bits) - 1)
    return tree, faces, config, draw(hnp.arrays(np.int64, (vertices, 3), elements=pattern))


ONE = Tree(np.full((1, 2), ~0, np.int32), np.ones(1, np.uint8))
TWO = Tree(np.array([[~1, ~0]], np.int32), np.ones(1, np.uint8))


@settings(max_examples=200, deadline=None)
@given(cases())
@example((ONE, np.array([[0, 0, 0]], np.int32), TINY, np.array([[1, 2, 3]])))
@example((ONE, np.array([[2, 0, 1]], np.int32), TINY, np.arange(9).reshape(3, 3)))
@example((TWO, np.array([[2, 0, 1], [2, 1, 3]], np.int32), TINY, np.arange(12).reshape(4, 3)))
def test_any_tree_and_mesh(case):
    assert_right(*case)


@pytest.mark.parametrize("config", CONFIGS.values(), ids=CONFIGS)
@pytest.mark.parametrize("shape", ["chain", "mirrored chain", "balanced", "random", "built"])
def test_larger_trees(config, shape, rng):
    faces = rng.integers(0, 300, (128, 3)).astype(np.int32)
    tree = {
        "chain": lambda: chain(128, leaf_left=True),
        "mirrored chain": lambda: chain(128, leaf_left=False),
        "balanced": lambda: balanced(7),
        "random": lambda: random_tree(rng, 128),
        "built": lambda: build(rng.random((300, 3)), faces),
    }[shape]()
    assert_right(tree, faces, config, rng.integers(0, 1 << config.fmt.bits, (300, 3)))


@pytest.mark.parametrize("registers", range(3, 65))
def test_every_number_of_registers(registers, rng):
    vertices, faces = icosphere(1)
    tree = build(vertices, faces)
    boxes = max(registers, needs(tree)[0])
    config = Config(vertex_registers=registers, box_registers=boxes, latency=registers)
    assert_right(tree, faces, config, rng.integers(0, 1 << 24, (len(vertices), 3)))


def test_exactly_as_many_boxes_as_the_order_needs(rng):
    """Leaves are hoisted into free registers, and yet nothing waits for ever."""
    for _ in range(20):
        tree = random_tree(rng, 200)
        faces = rng.integers(0, 150, (200, 3)).astype(np.int32)
        need = needs(tree)[0]
        config = Config(box_registers=need, vertex_registers=int(rng.integers(3, 65)))
        image = assert_right(tree, faces, config, rng.integers(0, 1 << 24, (150, 3)))
        assert image.order.boxes == need
        if need > 2:
            with pytest.raises(InputError, match="box registers"):
                compile_tree(tree, faces, replace(config, box_registers=need - 1))


def test_order_of_records(rng):
    """Vertices in the order of their first loads, triangles in that of the leaves."""
    vertices, faces = icosphere(2)
    image = compile_tree(build(vertices, faces), faces, FULL)
    loads = [take_apart(word) for word in image.instructions.tolist()]
    first = dict.fromkeys(operands[1] for name, operands in loads if name == "LOAD")
    assert list(first) == list(range(len(vertices)))
    below = leaves_below(image.order.children, image.nodes - 1)
    assert sorted(image.order.triangles[below].tolist()) == list(range(len(faces)))


def test_vertices_that_nothing_uses_get_no_record():
    faces = np.array([[9, 4, 7]], np.int32)
    image = compile_tree(ONE, faces, FULL)
    assert image.vertices.tolist() == [9, 4, 7]
    assert image.corners.tolist() == [[0, 1, 2], [0, 1, 2]]


def test_faces_of_other_types(rng):
    vertices, faces = icosphere(1)
    tree = build(vertices, faces)
    expected = compile_tree(tree, faces, FULL).instructions.tolist()
    for other in (faces.astype(np.int64), np.asfortranarray(faces), faces.astype(np.uint32)):
        assert compile_tree(tree, other, FULL).instructions.tolist() == expected


def test_too_many_vertices_for_an_instruction(monkeypatch):
    vertices, faces = icosphere(0)
    tree = build(vertices, faces)
    monkeypatch.setattr(compiler, "VERTEX_BITS", 3)
    with pytest.raises(InputError, match="12 vertices; an instruction addresses 8"):
        compile_tree(tree, faces, FULL)


def assert_few_loads(vertices, faces):
    image = compile_tree(build(vertices, faces), faces, FULL)
    check(FULL, image.instructions, len(image.vertices), image.nodes)
    assert len(image.vertices) / len(faces) <= loads_per_triangle(image) <= 0.54


def test_few_loads_on_the_elephant(scene_file):
    scene = load_scene(str(scene_file("elephant.npz")))
    assert_few_loads(scene.pose(0), scene.faces)


def test_few_loads_on_a_sphere_of_82k_triangles():
    assert_few_loads(*icosphere(6))


def test_few_loads_on_a_walker_of_80k_triangles():
    scene = load_scene("walker:80000")
    assert_few_loads(scene.pose(0), scene.faces)
