"""Words and instructions, against programs that are compiled one by one."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import FULL
from hdl.isa import Opcode
from sim.parts.analyse import analyse
from sim.parts.costs import Cost, costs
from sim.prepare import prepare
from sim.scene.load import load_scene
from sim.tree.rebuild import HOST_SECONDS
from tests.sim.parts.making import ball, bend, plate, rigid, scene_of, with_loose_vertex


def costs_of(scene, frames=None):
    analysis = analyse(scene, frames)
    return analysis, costs(scene, analysis, FULL)


@pytest.mark.parametrize("name", ["walker:2000", "burst:600"])
def test_a_scene_of_one_part_that_deforms_costs_what_the_machine_runs(name):
    scene = load_scene(name)
    image = prepare(scene, FULL).image
    analysis, found = costs_of(scene)
    expected = Cost(len(image.vertices), len(image.instructions))
    assert found.whole == found.divided == found.parts[0] == expected
    alone = prepare(scene, FULL, frames=range(1)).image
    for rebuild in found.rebuilds.values():
        assert rebuild.words == alone.size
        assert rebuild.milliseconds == pytest.approx(1e3 * HOST_SECONDS * len(scene.faces))
    assert len(found.rebuilds) == (1 if name.startswith("burst") else 0)


def test_an_instance_is_five_words_and_the_nodes_above_it(rng):
    """Two alone: two loads and a merge of three for each, one of two for the node above both."""
    things = [(ball((9 * k, 0, 0)), rigid(rng, 6)) for k in range(2)]
    scene = scene_of(6, *things)
    _, found = costs_of(scene)
    assert found.parts == [Cost(5.0, 7)] * 2  # of either, with the box of the other
    assert found.divided == Cost(10.0, 7)
    image = prepare(scene, FULL).image
    vertices = len(image.vertices)
    assert found.whole == Cost(vertices, len(image.instructions)) and vertices > 60
    merges = (image.instructions & 3 == Opcode.MERGE2.value).sum()
    assert merges == image.nodes > 100


def test_only_what_moves_is_written(rng):
    """A ball that rests every second frame, and a plate of which one corner moves."""
    hop = rigid(rng, 9)

    def hops(points, frame):
        return hop(points, frame // 2)

    def corner(points, frame):
        moved = points.copy()
        moved[-1] += 0.1 * frame * np.ones(3)
        return moved

    still = (plate((0, -5, 0), 20), None)
    scene = scene_of(9, (ball((5, 5, 5)), hops), still, (plate((0, 0, 0), 20), corner))
    analysis, found = costs_of(scene)
    assert [str(part.kind) for part in analysis.parts] == ["structured", "static", "continuous"]
    assert [cost.words for cost in found.parts] == [2.5, 0, 1]
    assert found.parts[1] == Cost(0, 0)
    assert 10 < found.parts[2].instructions < 200 < found.whole.instructions
    most = max(cost.instructions for cost in found.parts)
    assert most <= found.divided.instructions < sum(cost.instructions for cost in found.parts)
    assert found.divided.words == 3.5


def test_a_vertex_that_no_triangle_uses_is_not_written():
    scene = scene_of(4, (plate((0, 0, 0)), bend), (ball((5, 0, 0)), None))
    _, found = costs_of(with_loose_vertex(scene, 3))
    assert found == costs_of(scene)[1] and found.whole.words > 0


def test_of_what_rests_nothing_is_run():
    scene = scene_of(5, (ball((0, 0, 0)), None), (plate((3, 0, 0)), bend))
    _, found = costs_of(scene, range(1))
    assert found.parts == [Cost(0, 0)] and found.whole == found.divided == Cost(0, 0)


def test_a_machine_of_few_registers_runs_more():
    scene = load_scene("walker:2000")
    analysis = analyse(scene)
    few = costs(scene, analysis, replace(FULL, vertex_registers=16, box_registers=16))
    assert few.divided.instructions > costs(scene, analysis, FULL).divided.instructions
