"""sim.model.refit against what a bound is: the least and greatest corner of all leaves below."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hdl.config import FULL
from hdl.fp.format import F24, FloatFormat
from sim.compiler.order import order
from sim.model.fp.format import decode
from sim.model.refit import refit
from sim.prepare import prepare
from sim.scene.load import load_scene
from tests import oracle
from tests.sim.compiler.trees import balanced, chain, leaves_below, random_tree, trees

TINY_FORMAT = FloatFormat(3, 2)


def in_order(tree):
    triangles = int((~tree.children).max()) + 1
    return order(tree, np.arange(3 * triangles, dtype=np.int32).reshape(-1, 3), 64)


def from_leaves(fmt, ordered, corners):
    """Bounds of each node, from all corners below each child, by the oracle's order."""
    bounds = []
    for children, axis in zip(ordered.children.tolist(), ordered.axis.tolist(), strict=True):
        bounds.append([])
        for child in children:
            below = corners[leaves_below(ordered.children, child), :, axis].ravel().tolist()
            bounds[-1] += [oracle.low(fmt, *below), oracle.high(fmt, *below)]
    return bounds


@settings(max_examples=100, deadline=None)
@given(trees(most=20), st.sampled_from([TINY_FORMAT, F24]), st.integers(0, 2**32 - 1))
def test_any_tree(tree, fmt, seed):
    """Any patterns, canonical or not."""
    ordered = in_order(tree)
    rng = np.random.default_rng(seed)
    corners = rng.integers(0, 1 << fmt.bits, (len(ordered.triangles), 3, 3))
    assert refit(fmt, ordered, corners).tolist() == from_leaves(fmt, ordered, corners)


@pytest.mark.parametrize("shape", ["chain", "balanced", "random"])
def test_larger_trees(shape, rng):
    tree = {
        "chain": lambda: chain(128, leaf_left=True),
        "balanced": lambda: balanced(7),
        "random": lambda: random_tree(rng, 128),
    }[shape]()
    ordered = in_order(tree)
    corners = rng.integers(0, 1 << F24.bits, (128, 3, 3))
    assert refit(F24, ordered, corners).tolist() == from_leaves(F24, ordered, corners)


def test_signs_of_zero_are_told_apart():
    """All vertices are zeros: low is -0 where there is one, high is +0 where there is one."""
    minus, plus = 1 << (F24.bits - 1), 0
    ordered = in_order(balanced(1))
    for left, right, expected in [
        ([plus, minus, plus], [plus] * 3, [minus, plus, plus, plus]),
        ([minus] * 3, [plus, plus, minus], [minus, minus, minus, plus]),
    ]:
        corners = np.repeat(np.array([left, right])[:, :, None], 3, axis=2)
        corners = corners[ordered.triangles]
        found = refit(F24, ordered, corners)[0].tolist()
        assert found == (expected if ordered.triangles[0] == 0 else expected[2:] + expected[:2])


def ranges(ordered):
    """First leaf and the one after the last of each child (N, 2 children, 2)."""
    spans = {}
    for child in range(-len(ordered.triangles), len(ordered.axis)):
        if child < 0:
            spans[child] = ~child, ~child + 1
        else:
            parts = sorted(spans[c] for c in ordered.children[child].tolist())
            assert parts[0][1] == parts[1][0], f"the leaves below node {child} have gaps"
            spans[child] = parts[0][0], parts[1][1]
    return np.array([[spans[c] for c in pair] for pair in ordered.children.tolist()])


def test_all_frames_of_the_elephant(scene_file):
    """Another way there: reductions over ranges of leaves, in float64."""
    prepared = prepare(load_scene(str(scene_file("elephant.npz"))), FULL)
    ordered = prepared.image.order
    spans = ranges(ordered)
    nodes = np.arange(len(spans))
    for frame in prepared.frames:
        bits = prepared.coordinates(frame)
        corners = decode(F24, bits)[prepared.leaf_vertices]
        # One more leaf, so that a range may end after the last one.
        corners = np.concatenate([corners, corners[:1]])
        low, high = corners.min(axis=1), corners.max(axis=1)
        columns = []
        for side in range(2):
            pairs = spans[:, side].ravel()
            columns += [
                np.minimum.reduceat(low, pairs)[::2][nodes, ordered.axis],
                np.maximum.reduceat(high, pairs)[::2][nodes, ordered.axis],
            ]
        found = decode(F24, refit(F24, ordered, bits[prepared.leaf_vertices]))
        assert (found == np.stack(columns, axis=1)).all(), f"frame {frame}"


def test_bounds_are_coordinates_of_the_mesh(scene_file):
    """Nothing is rounded: every bound is one of the patterns that went in."""
    prepared = prepare(load_scene(str(scene_file("elephant.npz"))), FULL, frames=range(1))
    bits = prepared.coordinates(0)
    found = refit(F24, prepared.image.order, bits[prepared.leaf_vertices])
    for axis in range(3):
        assert np.isin(found[prepared.image.order.axis == axis], bits[:, axis]).all()
