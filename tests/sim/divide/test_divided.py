"""sim.divide: scenes part by part, by the model and in the Verilog."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import TWO_LEVEL
from sim.cosim.machine import Timing
from sim.cosim.stage import Stage
from sim.cosim.verilate import simulator
from sim.divide.divided import divide
from sim.errors import InputError
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays
from sim.model.refit import box_corners, refit
from sim.model.update import execute
from sim.oracle.taxonomy import CLASSES
from sim.prepare import prepare, view_of
from sim.report.passes import judge
from sim.report.pixels import camera_rays
from sim.scene.camera import auto
from sim.scene.load import load_scene
from sim.tree.shape import depth
from tests.hdl.machines import TINY
from tests.sim.parts.making import shuffled

SCENES = ("room:2000", "propeller:2000", "fleet:3000", "burst:300", "walker:500")


@pytest.fixture(scope="module", params=SCENES)
def divided(request):
    return divide(load_scene(request.param), TWO_LEVEL)


def bounds_of(prepared, bits) -> np.ndarray:
    return refit(prepared.config.fmt, prepared.image.order, bits[prepared.leaf_vertices])


def rays_of(prepared, frame: int, width: int = 64, height: int = 48) -> Rays:
    camera = auto(prepared.scene.pose(frame)[None], prepared.scene.faces, width, height)
    return camera_rays(prepared.config.fmt, view_of(prepared.config.fmt, camera))


def test_the_program_updates_what_moves(divided):
    config, image = divided.config, divided.image
    bits = divided.coordinates(divided.frames[0])
    bounds = bounds_of(divided, bits)
    still = box_corners(config.fmt, bits[divided.leaf_vertices], image.still)
    for frame in (divided.frames[5], divided.frames[-1]):
        bits = divided.coordinates(frame)
        records = np.zeros((image.records, 3), np.int64)
        records[: len(image.vertices)] = bits[image.vertices]
        records[image.records - len(still) :] = still
        updated = execute(config, image.instructions, records, bounds)
        assert (updated == bounds_of(divided, bits)).all()


def test_vertices_are_where_they_should_be(divided):
    for frame in (divided.frames[3], divided.frames[-1]):
        held = divided.vertices(divided.coordinates(frame), divided.rows(frame))
        assert np.abs(held - divided.scene.pose(frame)).max() < 2.0**-16


def test_rays_hit_what_they_hit_in_one_tree(divided):
    """The same triangle, or one that rounding explains to exact hits of that tree's mesh."""
    flat = prepare(load_scene(divided.scene.name), replace(TWO_LEVEL, instances=False))
    frame = divided.frames[7]
    bits, rows = flat.coordinates(frame), flat.rows(frame)
    rays = rays_of(flat, frame)
    vertices = flat.vertices(bits, rows)
    hits = flat.trace(bits, rows, bounds_of(flat, bits), rays).fields(TWO_LEVEL)
    leaves = flat.surfaces(hits)
    triangle = np.where(leaves < 0, -1, flat.image.order.triangles[leaves])
    t = decode(TWO_LEVEL.fmt, hits["t"])

    bits, rows = divided.coordinates(frame), divided.rows(frame)
    moved = np.linalg.norm(divided.vertices(bits, rows) - vertices, axis=1).max()
    hits = divided.trace(bits, rows, bounds_of(divided, bits), rays).fields(TWO_LEVEL)
    found = judge(divided, vertices, rays, hits, moved=moved)
    assert found.unexplained == 0 and moved < 2.0**-15, found
    other = divided.surfaces(hits) != triangle
    assert (triangle >= 0).mean() > 0.05 and other.mean() < 0.01
    same = ~other & (triangle >= 0)
    assert np.abs(t[same] - decode(TWO_LEVEL.fmt, hits["t"][same])).max() < 1e-3
    kinds = np.array(CLASSES)[found.kinds[other]]
    print(f"{divided.scene.name}: {len(kinds)} of {len(other)} see another triangle", *kinds)


def test_the_order_of_traversal_never_changes_a_hit(divided, rng):
    """Each ray alone, and beside others, finds the same bits."""
    frame = divided.frames[11]
    bits, rows = divided.coordinates(frame), divided.rows(frame)
    bounds = bounds_of(divided, bits)
    whole = rays_of(divided, frame, 32, 24)
    order = rng.permutation(len(whole.t_min))
    shuffled = Rays(*(x[order] for x in (whole.origins, whole.directions, whole.t_min)),
                    whole.t_max[order], whole.pixels[order])  # fmt: skip
    together = divided.trace(bits, rows, bounds, whole).fields(TWO_LEVEL)
    apart = divided.trace(bits, rows, bounds, shuffled).fields(TWO_LEVEL)
    for name in together:
        assert (together[name][order] == apart[name]).all(), name


def test_cycles_follow_what_moves():
    """A room with a fan, a ball and a curtain; eight ships on a sea; nothing at all."""
    for spec, share in (("room", 0.02), ("fleet:20k", 0.002)):
        scene = load_scene(spec)
        whole = len(prepare(scene, TWO_LEVEL).image.instructions)
        assert 0 < len(divide(scene, TWO_LEVEL).image.instructions) < share * whole
    still = replace(load_scene("room:500"), frames=1)
    image = divide(still, TWO_LEVEL).image
    assert len(image.instructions) == len(image.instances) == 0


def test_without_instances_parts_deform():
    scene = load_scene("fleet:3000")
    prepared = divide(scene, replace(TWO_LEVEL, instances=False))
    assert not len(prepared.image.instances)
    assert len(prepared.image.instructions) > 2 * 2000
    assert prepared.margin is None


def test_trees_are_built_again_where_refit_fails():
    prepared = divide(load_scene("burst:300"), TWO_LEVEL)
    later = prepared.at(0)
    assert later is not prepared and later.at(0) is later and later.at(8) is not later
    assert later.image.size == prepared.image.size
    walker = divide(load_scene("walker:500"), TWO_LEVEL)
    assert walker.at(12) is walker


def test_trees_change_in_place():
    """Programs of other trees load shared vertices more often; all records stay where they are."""
    prepared = divide(shuffled(128), replace(TWO_LEVEL, vertex_registers=3))
    regions, lengths = prepared.image.regions, set()
    for frame in prepared.frames:
        prepared = prepared.at(frame)
        assert prepared.image.regions == regions
        lengths.add(len(prepared.image.instructions))
    assert len(lengths) > 3


def test_stacks_hold_both_trees():
    prepared = divide(load_scene("fleet:500"), replace(TWO_LEVEL, stack_depth=9))
    assert depth(prepared.tree) <= 9 < prepared.levels
    with pytest.raises(InputError, match=f"tree has {prepared.levels} levels and a stack holds 9"):
        Stage(prepared, 4, Timing())


def test_registers_are_for_what_moves():
    """Two thousand triangles in eight ships, and a program that four box registers run."""
    scene = load_scene("fleet:2000")
    small = replace(TWO_LEVEL, box_registers=5)
    with pytest.raises(InputError, match="box_registers is 5"):
        prepare(scene, small)
    assert divide(scene, small).image.order.boxes <= 5


@pytest.mark.skipif(simulator() == "icarus", reason="hundreds of times slower")
@pytest.mark.parametrize("spec", ["room:500", "fleet:500", "shuffled"])
def test_in_the_verilog(spec):
    """Memory and hits word for word, over frames that move; and what the host sends."""
    prepared = divide(shuffled(64) if spec == "shuffled" else load_scene(spec), TINY)
    frames = prepared.frames
    rays = rays_of(prepared, frames[4], 24, 16)
    with Stage(prepared, len(rays.t_min), Timing(4)) as stage:
        for frame in (frames[5], frames[0], frames[0], frames[5]):
            moved = stage.show(frame)
            assert (moved is None) == (stage.sent == 0)
            found = stage.machine.read(0, stage.pose.image.size)
            assert (found == stage.pose.words).all()
            hits, expected = stage.cast(rays).hits, stage.model(rays).fields(TINY)
            assert all((hits[name] == expected[name]).all() for name in expected)
            assert (stage.pose.prepared.surfaces(hits) >= 0).any()
    if spec == "shuffled":
        assert stage.pose.prepared is not prepared
    if spec == "fleet:500":
        assert stage.sent <= 5 * len(prepared.image.instances)


def test_too_small_a_machine_is_refused():
    scene = load_scene("fleet:500")
    with pytest.raises(InputError, match="pointer_bits is 6"):
        divide(scene, replace(TWO_LEVEL, pointer_bits=6))
    with pytest.raises(InputError, match="memory words"):
        divide(scene, replace(TWO_LEVEL, address_bits=8))


def test_encode_is_not_changed_by_division():
    """Points of still parts are those of the scene, rounded once."""
    scene = load_scene("room:500")
    prepared = divide(scene, TWO_LEVEL)
    static = prepared.analysis.parts[0]
    bits = prepared.coordinates(3)[static.vertices]
    assert (bits == encode(TWO_LEVEL.fmt, prepared.scene.pose(3)[static.vertices])).all()
