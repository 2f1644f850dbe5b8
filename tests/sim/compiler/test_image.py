"""sim.compiler.image: every bit of every record, packed again by hand on Python's integers."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import FULL, Config
from hdl.fp.format import F24, FloatFormat
from sim.compiler.compile import compile_tree
from sim.errors import InputError
from sim.tree.build import build
from sim.tree.tree import Tree
from tests.sim.compiler.trees import icosphere, random_tree

# Format: bits of a memory word, as hdl.records says of it. 7,17 is the first that takes 256.
WORD_BITS = {(7, 16): 128, (7, 17): 256, (8, 23): 256, (4, 9): 128, (2, 1): 128}


@pytest.fixture(params=WORD_BITS, ids=str)
def image(request, rng):
    tree = random_tree(rng, 60)
    faces = rng.integers(0, 50, (60, 3)).astype(np.int32)
    return compile_tree(tree, faces, Config(FloatFormat(*request.param)))


def as_ints(words) -> list[int]:
    assert words.dtype == np.uint32
    return [sum(limb << 32 * k for k, limb in enumerate(word)) for word in words.tolist()]


def packed(*fields: tuple[int, int]) -> int:
    """Fields (value, width) from the lowest bit on."""
    word = at = 0
    for value, width in fields:
        assert 0 <= value < 1 << width
        word |= value << at
        at += width
    return word


def patterns(rng, image, *shape):
    """Random patterns, with the first all ones and the last all zeros."""
    values = rng.integers(0, 1 << image.config.fmt.bits, shape)
    values[0], values[-1] = (1 << image.config.fmt.bits) - 1, 0
    return values


def link(image, node: int) -> int:
    left, right = image.order.children[node].tolist()
    pointer = ~left if left < 0 else left
    axis = int(image.order.axis[node])
    return packed((axis, 2), (left < 0, 1), (right < 0, 1), (pointer, 28))


def word_bits(image) -> int:
    fmt = image.config.fmt
    bits = WORD_BITS[fmt.exp_bits, fmt.man_bits]
    assert image.limbs == bits // 32
    return bits


def test_regions_follow_each_other(image):
    per_word = word_bits(image) // 32
    assert image.nodes == 59
    assert image.vertices_at == -(-len(image.instructions) // per_word)
    assert image.triangles_at == image.vertices_at + len(image.vertices)
    assert image.nodes_at == image.triangles_at + 60
    assert image.size == image.nodes_at + 59
    assert image.constant_words().shape == (image.size, per_word)


def test_constant_words(image):
    per_word = word_bits(image) // 32
    program = image.instructions.tolist()
    program += [0] * (-len(program) % per_word)
    expected = [
        packed(*((word, 32) for word in program[at : at + per_word]))
        for at in range(0, len(program), per_word)
    ]
    expected += [0] * len(image.vertices)
    expected += [packed(*((v, 32) for v in corners)) for corners in image.corners.tolist()]
    expected += [link(image, node) << word_bits(image) - 32 for node in range(image.nodes)]
    assert as_ints(image.constant_words()) == expected


def test_vertex_words(image, rng):
    bits = image.config.fmt.bits
    coordinates = patterns(rng, image, 50, 3)
    words = image.vertex_words(coordinates)
    assert words.shape == (len(image.vertices), image.limbs)
    assert as_ints(words) == [
        packed(*((x, bits) for x in coordinates[vertex].tolist())) for vertex in image.vertices
    ]


def test_node_words_and_back(image, rng):
    bits = image.config.fmt.bits
    bounds = patterns(rng, image, image.nodes, 4)
    words = image.node_words(bounds)
    assert as_ints(words) == [
        packed(*((bound, bits) for bound in bounds[node].tolist()))
        | link(image, node) << word_bits(image) - 32
        for node in range(image.nodes)
    ]
    assert (image.bounds_of(words) == bounds).all()
    # Bounds leave the links alone: with all of them zero it is the constant image.
    assert (image.node_words(0 * bounds) == image.constant_words()[image.nodes_at :]).all()


def test_link_by_hand():
    """F24: two leaves, then a leaf beside them, then two of those. By hand to the last bit."""
    children = [[1, 2], [3, ~2], [~3, 4], [~0, ~1], [~4, ~5]]
    tree = Tree(np.array(children, np.int32), np.array([2, 1, 0, 1, 2], np.uint8))
    image = compile_tree(tree, np.arange(18, dtype=np.int32).reshape(6, 3), FULL)
    links = [word >> 96 for word in as_ints(image.node_words(np.zeros((5, 4), np.int64)))]
    assert links == [
        0 << 4 | 0b11_01,  # leaves 0 and 1, on y
        2 << 4 | 0b01_01,  # leaf 2, node 0, on y
        3 << 4 | 0b11_10,  # leaves 3 and 4, on z
        5 << 4 | 0b01_00,  # leaf 5, node 2, on x
        1 << 4 | 0b00_10,  # nodes 1 and 3, on z
    ]


def test_refuses_what_a_field_does_not_hold(image, rng):
    for wrong in (-1, 1 << image.config.fmt.bits):
        coordinates = patterns(rng, image, 50, 3)
        coordinates[image.vertices[5], 1] = wrong
        with pytest.raises(ValueError, match=f"{image.config.fmt.bits} bits do not hold"):
            image.vertex_words(coordinates)
        bounds = patterns(rng, image, image.nodes, 4)
        bounds[7, 2] = wrong
        with pytest.raises(ValueError, match=f"{image.config.fmt.bits} bits do not hold"):
            image.node_words(bounds)


def test_too_few_address_bits():
    vertices, faces = icosphere(1)
    tree = build(vertices, faces)
    size = compile_tree(tree, faces, FULL).size
    fits = (size - 1).bit_length()
    assert compile_tree(tree, faces, replace(FULL, address_bits=fits)).size == size
    with pytest.raises(InputError) as caught:
        compile_tree(tree, faces, replace(FULL, address_bits=fits - 1))
    assert f"takes {size} memory words" in str(caught.value)
    assert f"addresses {1 << (fits - 1)}:" in str(caught.value)


def test_a_memory_may_be_filled_to_the_last_word(rng):
    """Of scenes around 128 words, those of exactly 128 still fit in 7 bits."""
    exact = 0
    for triangles in range(25, 45):
        tree = random_tree(rng, triangles)
        for used in range(3, 40):
            faces = (np.arange(3 * triangles) % used).astype(np.int32).reshape(-1, 3)
            if compile_tree(tree, faces, Config(F24)).size == 128:
                compile_tree(tree, faces, Config(F24, address_bits=7))
                exact += 1
    assert exact
