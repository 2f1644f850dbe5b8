"""One scene: its rates, its bounds after many frames, and what its tree comes to cost."""

from dataclasses import replace

import numpy as np

from hdl.config import FULL
from sim.command import format_of
from sim.cosim.machine import Timing
from sim.prepare import Prepared, prepare
from sim.report.update import UpdateReport, measure_update
from sim.scene.load import load_scene
from sim.study.hardware import MEASURED, read_hardware
from sim.study.motion.carried import carried
from sim.study.motion.costs import CYCLES_PER_STEP, FORMULA, Prices, repaid, stops
from sim.study.motion.rates import rates
from sim.study.policies.cycles import update_cycles
from sim.tree.build import build, spread
from sim.tree.rebuild import HOST_SECONDS, rebuilt_cost, refitted_cost

TREES = ("poses", "first")
"""That are refitted: the machine's, built over three poses of the period, and one that is built
over the first frame and knows nothing of what comes."""
IN_A_ROW = 17
"""Frames that policies are compared over, with a first one in which each makes all bounds."""


def measure(cell: dict) -> dict:
    """A cell of sim.study.sweep: {scene, frames, format, samples, verilog, policies, rays}.

    Parameters
    ----------
    cell : dict
        scene (a built-in figure with its size), frames (of its period), format, samples (frames
        at which trees are compared), verilog (frames that the Verilog updates), policies (of
        sim.study.policies), rays (of a frame, for cycles).

    Returns
    -------
    dict
        scene, format, triangles, vertices, nodes; of sim.study.motion.carried: updates, words,
        differing, moved; of the Verilog: verilog_frames, mismatches (words of the whole memory),
        mismatches_shown, update_cycles (the mean of a frame); of the samples: frames, rates,
        rates_median, rates_largest, sah (for "poses", "first" and "rebuilt" the cost at each);
        by tree ("poses", "first"): stops (a frame, or None for never), unpaid (share of samples
        in which refit does not pay); repaid (a frame of the tree "first", or None); policies
        (for each the mean update cycles of a frame, after the first), policy_frames (first and
        last); rebuild_cycles, most (SAH cost above that of a new tree at which refit stops
        paying), rays, formula, clock_mhz, cycles_per_step, host_seconds.

    Raises
    ------
    InputError
        The scene or the format is at fault.
    """
    scene = load_scene(cell["scene"], period=cell["frames"])
    prepared = prepare(scene, replace(FULL, fmt=format_of(cell["format"])))
    report = _in_verilog(prepared, cell["verilog"])
    update = round(float(np.mean(report.cycles_per_frame)))
    clock = read_hardware(MEASURED).figures(cell["format"])["clock_mhz"]
    image = prepared.image
    prices = Prices(len(scene.faces), image.size, cell["rays"], update, clock)
    return {
        "scene": cell["scene"],
        "format": cell["format"],
        "triangles": len(scene.faces),
        "vertices": len(image.vertices),
        "nodes": image.nodes,
        **carried(prepared),
        "verilog_frames": report.frames,
        "mismatches": report.mismatches,
        "mismatches_shown": report.mismatches_shown,
        "update_cycles": update,
        **_compared(prepared, cell["samples"], prices),
        **_by_policy(prepared, cell["policies"]),
        "rebuild_cycles": round(prices.rebuild),
        "most": prices.most,
        "rays": cell["rays"],
        "formula": FORMULA,
        "clock_mhz": clock,
        "cycles_per_step": CYCLES_PER_STEP,
        "host_seconds": HOST_SECONDS,
    }


def _in_verilog(prepared: Prepared, count: int) -> UpdateReport:
    """Some of the frames, from the first on, in one memory of the Verilog."""
    step = max(1, len(prepared.frames) // count)
    some = replace(prepared.normalised, frames=prepared.frames[::step])
    return measure_update(replace(prepared, normalised=some), Timing())


def _by_policy(prepared: Prepared, policies: list[str]) -> dict:
    """Update cycles of policies, over frames in a row: of those that are far apart all moves."""
    start = len(prepared.frames) * 3 // 8  # the cloth is falling, the shock half across
    frames = prepared.frames[start : start + IN_A_ROW]
    cycles = {name: update_cycles(prepared, name, frames)[1:] for name in policies}
    return {
        "policies": {name: float(np.mean(spent)) for name, spent in cycles.items()},
        "policy_frames": [frames[0], frames[-1]],
    }


def _compared(prepared: Prepared, samples: int, prices: Prices) -> dict:
    """Rates, costs and what follows from them, at samples."""
    scene, frames = prepared.scene, spread(prepared.frames[:-1], samples)
    found = rates(scene, frames)
    moving = [ratio for ratio in found if ratio is not None]
    trees = {
        "poses": prepared.tree,
        "first": build(scene.pose(prepared.frames[0]), scene.faces),
    }
    sah = {
        name: [refitted_cost(scene, tree, frame) for frame in frames]
        for name, tree in trees.items()
    }
    sah["rebuilt"] = [rebuilt_cost(scene, frame) for frame in frames]
    above = {name: np.subtract(sah[name], sah["rebuilt"]) for name in TREES}
    return {
        "frames": frames,
        "rates": found,
        "rates_median": float(np.median(moving)) if moving else None,
        "rates_largest": max(moving, default=None),
        "sah": sah,
        "stops": {
            name: stops(scene, trees[name], frames, above[name].tolist(), prices) for name in TREES
        },
        "repaid": repaid(scene, trees["first"], frames, above["first"].tolist(), prices),
        "unpaid": {name: float((above[name] > prices.most).mean()) for name in TREES},
    }
