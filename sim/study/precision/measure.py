"""One scene, one frame, one float format: error and cycles."""

from dataclasses import replace

import numpy as np

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from hdl.rays.packet import NO_TRIANGLE
from sim.command import checked, format_of
from sim.cosim.machine import Timing
from sim.cosim.stage import Cast, Stage
from sim.errors import InputError
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays
from sim.oracle.trace import trace
from sim.prepare import Prepared, prepare, view_of
from sim.report.passes import check_pass
from sim.report.pixels import camera_rays
from sim.scene.camera import Camera, auto
from sim.scene.load import load_scene
from sim.study.precision.errors import errors, silhouettes


def measure(cell: dict) -> dict:
    """A cell of sim.study.sweep: {scene, format, frame, width, height}.

    The full machine of the format updates the tree to the frame from the one before (from the
    last to the first), and casts the rays of a camera that the scene fills, all in the Verilog.

    Returns
    -------
    dict
        triangles; of sim.study.precision.errors against float64 on vertices and rays that are not
        rounded: pixels, edge_pixels, wrong, silhouette, inside, lost, false, t_median, t_99,
        t_max; of the Verilog: update_cycles (0 where no vertex moves), ray_cycles, cycles (both),
        cycles_per_ray, steps_per_packet, overflow (names of the units in which numbers became
        infinite), mismatches (hits and counters that are not the model's), mismatches_shown.

    Raises
    ------
    InputError
        There is no such format or machine, or it does not hold the scene or the camera.
    """
    scene = load_scene(cell["scene"])
    fmt = format_of(cell["format"])
    config = machine_of(fmt)
    frame, width, height = cell["frame"], cell["width"], cell["height"]
    prepared = prepare(scene, config)
    pose = prepared.scene.pose(frame)
    camera = auto(pose[None], scene.faces, width, height)
    _check_steps(fmt, camera)
    view = view_of(fmt, camera)
    rays = camera_rays(fmt, view)
    with Stage(prepared, len(rays.pixels), Timing(latency=config.latency)) as stage:
        stage.show(prepared.frames[frame - 1])
        updated = stage.show(frame)
        cast = stage.look(view)
        done = check_pass(f"frame {frame}", stage, rays, cast)
    update_cycles = sum(updated["update"].values()) if updated else 0
    return {
        "triangles": len(scene.faces),
        **_against_truth(prepared, camera, pose, rays, cast),
        "update_cycles": update_cycles,
        "ray_cycles": done.cycles,
        "cycles": update_cycles + done.cycles,
        "cycles_per_ray": done.cycles / done.rays,
        "steps_per_packet": done.counters["steps"] / done.counters["packets"],
        "overflow": sorted(name for name, bit in cast.counters["overflows"].items() if bit),
        "mismatches": done.mismatches,
        "mismatches_shown": done.shown if done.mismatches else [],
    }


def machine_of(fmt: FloatFormat) -> Config:
    """The full machine with another format.

    Raises
    ------
    InputError
        It cannot be built.
    """
    checked(lambda: fmt.difference)  # which the triangle test asks for
    return checked(lambda: replace(FULL, fmt=fmt))


def _check_steps(fmt: FloatFormat, camera: Camera):
    """Refuse a format in which all pixels of a row, or of a column, look the same way."""
    for step in (camera.right, camera.down):
        if not decode(fmt, encode(fmt, step)).any():
            raise InputError(
                f"format {fmt} is too narrow: a pixel's step of {np.abs(step).max():.2g} becomes "
                f"zero, below its smallest number of {2.0**fmt.min_exp:.2g}; use more exponent bits"
            )


def _against_truth(
    prepared: Prepared, camera: Camera, pose: np.ndarray, rays: Rays, cast: Cast
) -> dict:
    """Errors of the image, whose pixels the oracle traces with nothing rounded."""
    shape = camera.height, camera.width
    y, x = np.indices(shape).reshape(2, -1, 1)
    directions = camera.corner + x * camera.right + y * camera.down
    zero, inf = np.zeros(len(directions)), np.full(len(directions), np.inf)
    origins = np.broadcast_to(camera.origin, directions.shape)
    truth = trace(pose, prepared.leaf_vertices, origins, directions, zero, inf)
    true_triangle, true_t = truth.triangle.reshape(shape), truth.t.reshape(shape)

    inside = rays.pixels >= 0
    ray_of = np.empty(len(directions), np.int64)
    ray_of[rays.pixels[inside]] = np.flatnonzero(inside)
    triangle = cast.hits["triangle"][ray_of].reshape(shape)
    t = decode(prepared.config.fmt, cast.hits["t"][ray_of]).reshape(shape)
    pixel = float(np.linalg.norm(camera.right))
    edges = silhouettes(true_triangle, true_t, pixel)  # t is depth: directions have length 1 there
    return errors(np.where(triangle == NO_TRIANGLE, -1, triangle), t, true_triangle, true_t, edges)
