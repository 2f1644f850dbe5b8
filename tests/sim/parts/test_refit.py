"""Whether one tree serves a part, and from when on not."""

from dataclasses import replace

import numpy as np
import pytest

from sim.parts.refit import refit_ratio
from sim.scene.load import load_scene
from sim.tree.build import build
from sim.tree.rebuild import rebuilt_cost, refitted_cost


@pytest.mark.parametrize("factor", [1.5, 3.0])
def test_a_burst_fails_where_it_does(factor):
    """Against every frame, tried one by one."""
    scene = load_scene("burst:600", period=60)
    tree = build(scene.pose(0), scene.faces)
    ratios = np.array([
        refitted_cost(scene, tree, frame) / rebuilt_cost(scene, frame) for frame in range(60)
    ])
    assert (np.diff(ratios[:30]) > 0).all()  # bisection finds the first only if there is one
    ratio, fails_from = refit_ratio(scene, range(60), factor)
    assert factor < ratio < ratios.max()
    assert fails_from == int(np.argmax(ratios > factor)) > 0


def test_a_tree_over_all_poses_serves_what_one_over_the_first_does_not():
    """A plate that is flat in the first frame: waves are none of its tree's business there."""
    scene = load_scene("shock:2000")
    first = build(scene.pose(0), scene.faces)
    assert refitted_cost(scene, first, 12) > 2 * rebuilt_cost(scene, 12)
    ratio, fails_from = refit_ratio(scene, range(24), 2.0)
    assert 1 <= ratio < 1.6 and fails_from is None


def test_the_last_frame_counts():
    """What bursts at once, after all poses that a tree is built over."""
    burst = load_scene("burst:600")
    late = replace(burst, pose=lambda frame: burst.pose(20 if frame == 23 else 0))
    ratio, fails_from = refit_ratio(late, range(24), 2.0)
    assert ratio > 2 and fails_from == 23


def test_one_frame_needs_no_other_tree():
    assert refit_ratio(load_scene("burst:600"), range(7, 8), 1.0) == (1.0, None)
