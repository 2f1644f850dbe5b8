"""One scene, one frame, one float format: error and cycles."""

from dataclasses import replace

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from sim.command import checked, format_of
from sim.compiler.rays import check_ray_format
from sim.cosim.machine import Timing
from sim.cosim.stage import Stage
from sim.prepare import prepare, view_of
from sim.report.passes import check_pass
from sim.report.pixels import camera_rays
from sim.scene.camera import auto
from sim.scene.load import load_scene
from sim.study.precision.truth import against_truth


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
        **against_truth(prepared, camera, pose, rays, cast.hits),
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
    config = checked(lambda: replace(FULL, fmt=fmt))
    check_ray_format(fmt)
    return config
