"""By how much the rates differ at which parts of a scene move."""

from collections.abc import Sequence

import numpy as np

from sim.scene.scene import Scene

PART = 0.01
"""Of the vertices that move: the fastest ones, and the slowest."""
STILL = 1e-13
"""Half sizes of a scene: what moves by less does not move but is rounded, in float64."""


def rates(scene: Scene, frames: Sequence[int]) -> list[float | None]:
    """For each frame the ratio of the fastest to the slowest moving vertices.

    How far a vertex moves from this frame to the next: the median of the fastest hundredth over
    that of the slowest hundredth, of the vertices that move. None where less than two do.

    Parameters
    ----------
    scene : Scene
        Normalised.
    frames : sequence of int
        Each has a next one.
    """
    return [_ratio(scene.pose(frame), scene.pose(frame + 1)) for frame in frames]


def _ratio(before: np.ndarray, after: np.ndarray) -> float | None:
    moved = np.sort(np.linalg.norm(after - before, axis=1))
    moved = moved[moved > STILL]
    if len(moved) < 2:
        return None
    count = max(1, round(PART * len(moved)))
    return float(np.median(moved[-count:]) / np.median(moved[:count]))
