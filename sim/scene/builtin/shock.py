"""`shock`: a shock that runs through a plate."""

import numpy as np

from sim.scene.builtin.shapes import check_size, grid
from sim.scene.scene import Scene

ARRIVAL = 0.9  # of the period, at the far corner
DECAY = 1 / 16  # of the period: the time in which ringing falls to 1/e
RINGING = 397  # cycles a period
WAVES = 5  # across the diagonal
HEIGHT = 0.08


def shock(spec: str, triangles: int, frames: int) -> Scene:
    """A unit square (y is up), struck at one corner: a front runs to the opposite one.

    Before it the plate is still, behind it rings and calms down: a damped oscillation, whose rate
    falls by 1e6 in 0.86 of the period. The waves inside travel faster than the front, as in any
    medium with dispersion, so that they are long although the ringing is fast. Frame 0 is flat.
    """
    check_size(spec, triangles, 2)
    across = max(1, round((triangles / 2) ** 0.5))
    along = max(1, round(triangles / 2 / across))
    uv, faces = grid(across, along)
    distance = np.hypot(*uv.T) / np.sqrt(2)
    flat = np.stack([uv[:, 0], np.zeros(len(uv)), uv[:, 1]], axis=1)

    def pose(frame: int) -> np.ndarray:
        since = np.maximum(frame / frames - ARRIVAL * distance, 0) / DECAY
        turn = 2 * np.pi * (RINGING * frame % frames / frames - WAVES * distance)
        vertices = flat.copy()
        vertices[:, 1] = HEIGHT * np.e * since * np.exp(-since) * np.cos(turn)
        return vertices

    return Scene(spec, faces, frames, pose)
