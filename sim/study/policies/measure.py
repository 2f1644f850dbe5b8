"""One policy over frames of a scene: cycles of the Verilog, and hits against fresh bounds."""

from dataclasses import replace

import numpy as np

from hdl.config import FULL
from hdl.rays.packet import NO_TRIANGLE
from sim.command import checked, format_of
from sim.compiler.rays import HIT_FIELDS
from sim.errors import InputError
from sim.model.rays.camera import Rays
from sim.model.rays.traversal import Hits
from sim.model.refit import refit
from sim.prepare import Prepared, prepare, spread, view_of
from sim.report.passes import class_counts, differences
from sim.report.pixels import camera_rays
from sim.scene.camera import auto
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from sim.study.policies.frames import Done, model, run
from sim.tree.cost import pose_cost

POSES = 3
"""Frames that the camera is chosen for."""

SUMMED = (
    "program_cycles",
    "host_words",
    "update_cycles",
    "render_cycles",
    "cycles",
    "lost",
    "false",
    "changed",
    "ties",
    "different",
    "rebuilds",
    "mismatches",
)
LISTED = (*SUMMED, "growth", "instructions", "sah_cost")


def measure(cell: dict) -> dict:
    """A cell of sim.study.sweep: {scene, format, policy, frames, width, height}.

    `frames` is a list of frames, one after the other; the camera stays. The tree is the one that
    sim.prepare builds over the whole scene, until the policy builds another.

    Returns
    -------
    dict
        policy, frames, triangles, pixels (of a frame), different_share (of all pixels of all
        frames). In sum over all frames, and under `per_frame` as lists:

        program_cycles : of the update processor
        host_words : memory words that the host writes for the update, vertices left out: of a new
            tree those that change, of an update of a part its program and the boxes beside it
        update_cycles : both; a word takes a cycle
        render_cycles : of the rays
        cycles : update and rays
        lost, false : rays that hit with fresh bounds and do not hit, and the reverse
        changed : rays that hit both times, not with the same bits of t, u, v and triangle
        ties : of these, another triangle at the same t: the tree says which of two comes first
        different : rays with another triangle; lost and false ones among them
        rebuilds : new trees
        mismatches : hits and bounds of the Verilog that are not the model's: 0 if it is right

        Only under `per_frame`: growth (of boxes, in normalised units), instructions, and sah_cost
        (of the tree with fresh bounds).

    Raises
    ------
    InputError
        There is no such policy, frame or format, or the machine is too small for the scene.
    """
    scene, frames = load_scene(cell["scene"]), cell["frames"]
    _check(scene, frames)
    fmt = format_of(cell["format"])
    prepared = prepare(scene, checked(lambda: replace(FULL, fmt=fmt)))
    poses = [prepared.scene.pose(frames[k]) for k in spread(range(len(frames)), POSES)]
    view = view_of(fmt, auto(np.stack(poses), scene.faces, cell["width"], cell["height"]))
    rays = camera_rays(fmt, view)
    done = run(prepared, cell["policy"], frames, view, rays)
    figures = [_figures(prepared, rays, of) for of in done]
    sums = {name: sum(of[name] for of in figures) for name in SUMMED}
    pixels = view.width * view.height
    return {
        "policy": cell["policy"],
        "frames": frames,
        "triangles": len(scene.faces),
        "pixels": pixels,
        **sums,
        "different_share": sums["different"] / (pixels * len(frames)),
        "per_frame": {name: [of[name] for of in figures] for name in LISTED},
    }


def _check(scene: Scene, frames: list[int]):
    beyond = [frame for frame in frames if not 0 <= frame < scene.frames]
    if beyond or not frames:
        fault = f"has no frame {beyond[0]}" if beyond else "no frame chosen"
        raise InputError(f"{scene.name}: {fault}; frames are 0 to {scene.frames - 1}")


def _figures(first: Prepared, rays: Rays, done: Done) -> dict:
    """LISTED of a frame. `first` has the tree whose refit is the reference."""
    frame, fmt = done.plan, first.config.fmt
    prepared, image = frame.prepared, frame.image
    fresh = refit(fmt, first.image.order, frame.bits[first.leaf_vertices])
    reference = _named(first, _fields(model(first, frame.bits, fresh, rays)))
    counts = class_counts(differences(fmt, _named(prepared, done.hits), reference))

    update_cycles = done.program_cycles + done.host_words
    changed = ("same_triangle", "tie", "nearer", "farther")
    wrong_nodes = (done.nodes != image.node_words(frame.bounds)).any(axis=1)
    return {
        "program_cycles": done.program_cycles,
        "host_words": done.host_words,
        "update_cycles": update_cycles,
        "render_cycles": done.render_cycles,
        "cycles": update_cycles + done.render_cycles,
        "lost": counts["hit_became_miss"],
        "false": counts["miss_became_hit"],
        "changed": sum(counts[kind] for kind in changed),
        "ties": counts["tie"],
        "different": sum(counts.values()) - counts["same_bits"] - counts["same_triangle"],
        "rebuilds": int(frame.rebuilt),
        "mismatches": int((differences(fmt, done.hits, _fields(done.expected)) != 0).sum())
        + int(wrong_nodes.sum()),
        "growth": frame.growth,
        "instructions": len(frame.program),
        "sah_cost": pose_cost(
            prepared.tree, prepared.scene.pose(frame.frame), prepared.scene.faces
        ),
    }


def _fields(hits: Hits) -> dict[str, np.ndarray]:
    """What a hit record has of the model's."""
    return {field: getattr(hits, field) for field in HIT_FIELDS}


def _named(prepared: Prepared, hits: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Hits whose triangle is that of the scene, not that of the tree's records."""
    record = hits["triangle"]
    hit = record != NO_TRIANGLE
    triangles = prepared.image.order.triangles[np.where(hit, record, 0)]
    return {**hits, "triangle": np.where(hit, triangles, NO_TRIANGLE)}
