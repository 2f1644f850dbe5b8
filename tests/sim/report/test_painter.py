"""sim.report.painter and motion: an animation in one light, and parts by how they move."""

import numpy as np
import pytest

from hdl.config import FULL, TWO_LEVEL
from sim.divide.divided import divide
from sim.parts.part import Kind
from sim.prepare import prepare
from sim.report.motion import COLOURS, tints_by_motion
from sim.report.painter import CHOICES, MOTION, check_view, painter_for
from sim.report.shade import VIEWS, shade
from sim.scene.load import load_scene
from tests.sim.report.views import CUBE, CUBE_FACES, seen_from

LAMP = np.array([3.0, 5, 2])


def srgb(kind: Kind) -> np.ndarray:
    return np.array(list(bytes.fromhex(COLOURS[kind])))


def test_colours_of_a_room_are_those_of_how_it_moves():
    """A fan, a ball and a curtain, in that order of their kinds; the rest is still."""
    divided = divide(load_scene("room:500"), TWO_LEVEL)
    parts = divided.analysis.parts
    assert {part.kind for part in parts} == {Kind.STATIC, Kind.STRUCTURED, Kind.CONTINUOUS}
    colours = tints_by_motion(parts)
    assert colours.shape == (len(divided.scene.faces), 3)
    shown = np.rint(255 * colours ** (1 / 2.2)).astype(int)
    for part in parts:
        assert (shown[part.faces] == srgb(part.kind)).all()
    assert len(np.unique(shown, axis=0)) == 3
    without = divide(load_scene("room:500"), FULL)  # nothing is an instance there
    shown = tints_by_motion(without.analysis.parts)
    assert len(np.unique(shown, axis=0)) == 2


def test_the_motion_view_is_the_shaded_one_in_other_colours():
    divided = divide(load_scene("burst:200"), FULL)
    seen = seen_from([2, 3, 4], (CUBE, CUBE_FACES))
    colours = tints_by_motion(divided.analysis.parts)
    painter = painter_for(MOTION, divided, LAMP)
    painter.paint(seen, None)
    expected = shade(seen, "shaded", lamp=LAMP, colours=colours)
    assert (painter.pictures[0] == expected).all()
    red, green, blue = expected[seen.hit].astype(int).T
    assert (red > 1.4 * np.maximum(green, blue)).all(), "what flies apart is red"


@pytest.mark.parametrize("view", VIEWS)
def test_frames_are_painted_in_one_light(view):
    """What an animation must not change is taken from its first frame."""
    prepared = prepare(load_scene("waves:50"), FULL)
    painter = painter_for(view, prepared, LAMP)
    near, far = (seen_from(eye, (CUBE, CUBE_FACES)) for eye in ([2, 3, 4], [4, 6, 8]))
    for seen in (near, far, near):
        painter.paint(seen, None)
    assert (painter.pictures[0] == painter.pictures[2]).all()
    t = near.t[near.hit]
    depths = float(t.min()), float(t.max())
    assert (painter.pictures[1] == shade(far, view, lamp=LAMP, depths=depths)).all()


@pytest.mark.parametrize("program", [("bkd-sim", "render"), ("bkd-host", "--port", "x", "play")])
def test_motion_of_a_scene_that_is_not_divided_is_refused(program, run):
    for view in CHOICES:
        check_view(view, divided=True)
    code, out, err = run(*program, "waves:50", "--view", MOTION)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "--view motion" in err and "--divide" in err
