"""sim.report.recording: hits that other machines can be held to."""

from dataclasses import replace

import pytest

from hdl.config import FULL, TWO_LEVEL
from sim.compiler.rays import HIT_FIELDS
from sim.model.rays.traversal import NO_TRIANGLE
from sim.pose import pose_of
from sim.prepare import prepare, view_of
from sim.report.pixels import camera_rays
from sim.report.recording import by_scene
from sim.scene.camera import auto
from sim.scene.load import load_scene


def hits_of(config, scene, frame: int):
    """A scene for a machine, the hits of a camera's rays by the model, and these `by_scene`."""
    prepared = prepare(scene, config)
    camera = auto(prepared.scene.pose(frame)[None], scene.faces, 64, 48)
    pose = pose_of(prepared, frame)
    rays = camera_rays(config.fmt, view_of(config.fmt, camera))
    hits = prepared.trace(pose.bits, pose.rows, pose.bounds, rays).fields(config)
    return prepared, hits, by_scene(prepared, hits)


@pytest.mark.parametrize("spec", ["walker:2000", "collapse:2000"])
@pytest.mark.parametrize(
    "changes", [{"box_registers": 13}, {"update": False}, {"folded": True, "vertex_registers": 8}]
)
def test_every_machine_sees_the_same_image(spec, changes):
    """Bit for bit, in one format: the order of leaves is the machine's, triangles are the scene's.

    Two triangles that are equally far are seen alike where the order of leaves is the same.
    """
    scene = load_scene(spec)
    full, hits, found = hits_of(FULL, scene, 7)
    other, other_hits, other_found = hits_of(replace(FULL, **changes), scene, 7)
    reordered = (full.image.order.triangles != other.image.order.triangles).any()
    assert reordered == ("box_registers" in changes)
    assert reordered == (hits["triangle"] != other_hits["triangle"]).any()
    assert all((found[name] == other_found[name]).all() for name in HIT_FIELDS)
    assert (found["triangle"] != NO_TRIANGLE).mean() > 0.2


def test_a_machine_with_instances_says_the_same_of_a_scene_without():
    scene = load_scene("walker:500")
    *_, found = hits_of(FULL, scene, 3)
    _, hits, other = hits_of(TWO_LEVEL, scene, 3)
    assert "instance" in hits and found.keys() == other.keys() == set(HIT_FIELDS)
    assert all((found[name] == other[name]).all() for name in HIT_FIELDS)
