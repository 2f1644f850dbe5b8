"""sim.report.mismatch: what is told of a word that differs."""

import numpy as np
import pytest

from hdl.config import FULL, Config
from hdl.fp.format import F24, FloatFormat
from sim.compiler.compile import compile_tree
from sim.report.mismatch import describe, mismatches
from sim.tree.build import build
from tests import oracle
from tests.sim.compiler.trees import icosphere


@pytest.fixture
def image():
    vertices, faces = icosphere(0)
    return compile_tree(build(vertices, faces), faces, FULL)


def test_mismatches_are_addresses(rng):
    expected = rng.integers(0, 1 << 32, (50, 4), np.uint32)
    found = expected.copy()
    assert mismatches(expected, found).tolist() == []
    found[[3, 17, 49], [0, 3, 2]] ^= np.uint32(1)
    assert mismatches(expected, found).tolist() == [3, 17, 49]


def test_regions_that_no_update_writes(image):
    """First and last word of each: the word within the region, and what was found, high to low."""
    expected = image.constant_words()
    found = expected.copy()
    found[:] = [0x89ABCDEF, 0x01234567, 0xFFFFFFFF, 1]
    text = "00000001ffffffff0123456789abcdef"
    for region, start, end in [
        ("program", 0, image.vertices_at),
        ("vertex", image.vertices_at, image.triangles_at),
        ("triangle", image.triangles_at, image.nodes_at),
    ]:
        for address in (start, end - 1):
            line = describe(image, address, expected[address], found[address])
            assert line == f"{region} word {address - start} was written: {text}"


def numbers(fmt, *values):
    return [oracle.encode(fmt, float(value)) for value in values]


def described(image, node, want, got):
    expected = image.node_words(np.tile(want, (image.nodes, 1)))[node]
    found = image.node_words(np.tile(got, (image.nodes, 1)))[node]
    return describe(image, image.nodes_at + node, expected, found)


@pytest.mark.parametrize("column", range(4))
@pytest.mark.parametrize("node", [0, 18])
def test_each_bound(image, node, column):
    name = ("left lo", "left hi", "right lo", "right hi")[column]
    want = np.array(numbers(F24, -1, -0.5, 0.5, 1))
    got = want.copy()
    got[column] += 1  # away from zero
    value = float(oracle.decode(F24, int(want[column])))
    line = described(image, node, want, got)
    ulp = "+1" if value > 0 else "-1"
    begin = f"node {node}, {name}: {got[column]:06x}, not {want[column]:06x}: {ulp} ulp, "
    assert line == begin + f"{value * (1 + 2**-16):.9g}, not {value:.9g}"


def test_first_of_several_bounds_is_told(image):
    line = described(image, 3, numbers(F24, 0, 0, 0, 0), numbers(F24, 0, 1, 2, 3))
    assert line.startswith("node 3, left hi: 3f0000, not 000000: ")
    assert line.endswith(" ulp, 1, not 0")


def test_zeros_and_infinities(image):
    line = described(image, 0, numbers(F24, 0, 0, 0, 0), numbers(F24, -0.0, 0, 0, 0))
    assert line == "node 0, left lo: 800000, not 000000: -1 ulp, -0, not 0"
    infinity = float("inf")
    line = described(image, 0, numbers(F24, *[infinity] * 4), numbers(F24, *[-infinity] * 4))
    ulps = -2 * 0x7F0000 - 1
    assert line == f"node 0, left lo: ff0000, not 7f0000: {ulps} ulp, -inf, not inf"


@pytest.mark.parametrize("bit", [96, 98, 99, 100, 127])
def test_link(image, bit):
    expected = image.constant_words()[-1]
    found = expected.copy()
    found[bit // 32] ^= np.uint32(1 << bit % 32)
    want = sum(limb << 32 * k for k, limb in enumerate(expected.tolist()))
    line = describe(image, image.size - 1, expected, found)
    assert line == f"node 18, link: {want ^ 1 << bit:032x}, not {want:032x}"


@pytest.mark.parametrize(("fmt", "digits"), [((4, 9), 4), ((8, 23), 8)])
def test_other_formats(fmt, digits):
    config = Config(FloatFormat(*fmt))
    vertices, faces = icosphere(0)
    image = compile_tree(build(vertices, faces), faces, config)
    want = numbers(config.fmt, 1, 1, -1, 1)
    got = numbers(config.fmt, 1, 1, -2, 1)
    line = described(image, 5, want, got)
    ulps = -(1 << config.fmt.man_bits)
    begin = f"node 5, right lo: {got[2]:0{digits}x}, not {want[2]:0{digits}x}"
    assert line == f"{begin}: {ulps} ulp, -2, not -1"
