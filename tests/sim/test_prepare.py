"""sim.prepare: from a scene to coordinates and a program, and the errors on the way."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from sim.compiler.check import check
from sim.errors import InputError
from sim.model.refit import refit
from sim.model.update import execute
from sim.prepare import COARSEST, prepare
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from sim.tree.build import BUILDERS
from tests import oracle
from tests.sim.compiler.trees import icosphere


def moving(frames: int = 3, **at):
    """A sphere that grows, with single coordinates replaced: at frame, vertex and axis."""
    vertices, faces = icosphere(1)

    def pose(frame):
        moved = vertices * (1 + 0.1 * frame)
        for value, (where, vertex, axis) in at.items():
            if frame == where:
                moved[vertex, axis] = float(value)
        return moved

    return Scene("sphere", faces, frames, pose)


def test_coordinates_of_the_elephant_are_rounded_once(scene_file, rng):
    """Against exact rationals: translated and scaled in float64, then one rounding."""
    scene = load_scene(str(scene_file("elephant.npz")))
    prepared = prepare(scene, FULL)
    low = np.min([scene.pose(frame).min(axis=0) for frame in prepared.frames], axis=0)
    high = np.max([scene.pose(frame).max(axis=0) for frame in prepared.frames], axis=0)
    centre = prepared.normalised.centre
    assert np.allclose(centre, (low + high) / 2, rtol=1e-15, atol=0)
    scale = 2.0**-prepared.normalised.exponent
    assert 0.5 < (np.maximum(high - centre, centre - low) * scale).max() <= 1
    for frame in (0, 17, 39):
        bits, exact = prepared.coordinates(frame), scene.pose(frame)
        assert bits.shape == exact.shape and bits.dtype == np.int64
        for vertex in rng.integers(0, len(exact), 200):
            for axis in range(3):
                expected = oracle.encode(
                    FULL.fmt, float(exact[vertex, axis] - centre[axis]) * scale
                )
                assert bits[vertex, axis] == expected, f"frame {frame}, vertex {vertex}"


def test_a_prepared_scene_runs():
    prepared = prepare(moving(), FULL, frames=range(1, 3))
    assert prepared.frames == range(1, 3) and prepared.config is FULL
    assert prepared.scene.name == "sphere"
    assert prepared.build_seconds > 0 and prepared.compile_seconds > 0
    image = prepared.image
    check(FULL, image.instructions, len(image.vertices), image.nodes)
    assert (prepared.leaf_vertices == image.vertices[image.corners]).all()
    bounds = np.zeros((image.nodes, 4), np.int64)
    for frame in prepared.frames:
        bits = prepared.coordinates(frame)
        bounds = execute(FULL, image.instructions, bits[image.vertices], bounds)
        expected = refit(FULL.fmt, image.order, bits[prepared.leaf_vertices])
        assert (bounds == expected).all()


def test_steps_are_told_in_their_order():
    told = []
    prepare(moving(), FULL, step=told.append)
    assert told == ["measuring all frames", "building the tree", "compiling the program"]


@pytest.mark.parametrize("builder", BUILDERS)
def test_builders(builder):
    prepared = prepare(moving(), FULL, builder=builder)
    assert len(prepared.tree.axis) == len(prepared.image.order.axis) == 79


def test_tree_is_built_over_chosen_frames():
    """A scene whose first frame is flat: a tree over that alone needs one axis only."""
    vertices, faces = icosphere(2)
    scene = Scene("flat", faces, 12, lambda frame: vertices * [1, min(frame, 1), min(frame, 1)])
    first = prepare(scene, FULL, frames=range(1))
    assert first.poses == [0] and (first.tree.axis == 0).all()
    some = prepare(scene, FULL)
    assert some.poses == [0, 4, 8] and (some.tree.axis != 0).any()
    assert prepare(scene, FULL, frames=range(3, 5)).poses == [3, 4]


def test_format_too_narrow_names_frame_and_vertex():
    """2,1 holds 1, 1.5, 2, 3 and no number below 1."""
    fmt = FloatFormat(2, 1)
    prepared = prepare(moving(), replace(FULL, fmt=fmt))
    exact = prepared.scene.pose(1)
    nearest = [oracle.decode(fmt, oracle.encode(fmt, x)) for x in exact.ravel().tolist()]
    rounded = np.array(nearest, np.float64).reshape(exact.shape)
    moved = np.abs(rounded - exact).max(axis=1)
    with pytest.raises(InputError) as caught:
        prepared.coordinates(1)
    assert moved.max() > COARSEST
    assert str(caught.value) == (
        f"sphere: format 2,1 is too narrow: it moves vertex {moved.argmax()} of frame 1 by "
        f"{moved.max():.2g} of the scene's half size; 4,2 is enough"
    )


@pytest.mark.parametrize(
    ("fmt", "height", "moved"),
    [((2, 7), 0.5, 0.5), ((3, 2), 0.2, 0.2), ((3, 2), 0.9375, None), ((3, 2), 0.0625, None)],
)
def test_format_too_narrow_in_one_frame_only(fmt, height, moved):
    """Below the smallest normal (1; 1/4) numbers become zero; 1/16 is not yet too far."""
    corners = np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
    faces = np.array([[0, 1, 2], [1, 2, 3]], np.int32)
    lifted = np.outer([0, 0, 1, 0], [0, 0, height])
    scene = Scene("flap", faces, 2, lambda frame: corners + frame * lifted)
    prepared = prepare(scene, Config(FloatFormat(*fmt)), frames=range(1))
    assert prepared.coordinates(0).shape == (4, 3)
    if moved is None:
        assert prepared.coordinates(1).shape == (4, 3)
    else:
        with pytest.raises(InputError, match=f"moves vertex 2 of frame 1 by {moved} of"):
            prepared.coordinates(1)


def test_a_coordinate_beyond_the_largest_number_is_too_narrow():
    """Frames that were not asked for may lie anywhere."""
    vertices, faces = icosphere(0)
    scene = Scene("leap", faces, 2, lambda frame: vertices * (1e30 if frame else 1))
    prepared = prepare(scene, FULL, frames=range(1))
    with pytest.raises(InputError, match=r"leap: format 7,16 .* vertex 0 of frame 1 by inf"):
        prepared.coordinates(1)


@pytest.mark.parametrize("value", ["nan", "inf"])
def test_frames_that_are_not_finite(value):
    scene = moving(**{value: (2, 5, 1)})
    with pytest.raises(InputError, match="sphere: frame 2, vertex 5 is"):
        prepare(scene, FULL)
    prepare(scene, FULL, frames=range(2))


@pytest.mark.parametrize("frames", [range(0), range(2, 4), range(-1, 1)])
def test_frames_that_there_are_not(frames):
    with pytest.raises(InputError, match="sphere: "):
        prepare(moving(), FULL, frames=frames)


def test_a_machine_too_small():
    with pytest.raises(InputError, match="address_bits is 4 and has to be"):
        prepare(moving(), replace(FULL, address_bits=4))
    with pytest.raises(InputError, match="box registers"):
        prepare(moving(), replace(FULL, box_registers=2))
