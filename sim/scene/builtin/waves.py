"""`waves`: the surface of water under wind."""

import numpy as np

from sim.scene.builtin.shapes import check_size, grid
from sim.scene.scene import Scene

# cycles across the unit square along x and z, periods in one loop, steepness, phase in radians
WAVES = np.array([
    [1, 0, 1, 0.26, 0.3],
    [1, 1, 1, 0.20, 1.9],
    [2, -1, 2, 0.18, 4.1],
    [3, 1, 2, 0.14, 2.6],
    [3, -4, 3, 0.10, 5.2],
    [6, 2, 3, 0.08, 0.9],
])


def waves(spec: str, triangles: int, frames: int) -> Scene:
    """A unit square (y is up) on which Gerstner waves travel; every triangle moves.

    Each point circles in a wave's vertical plane, so that crests are sharp and troughs flat.
    Source: Fournier, Reeves, "A simple model of ocean waves", SIGGRAPH 1986.
    """
    check_size(spec, triangles, 2)
    across = max(1, round((triangles / 2) ** 0.5))
    along = max(1, round(triangles / 2 / across))
    uv, faces = grid(across, along)
    rest = np.stack([uv[:, 0], np.zeros(len(uv)), uv[:, 1]], axis=1)

    def pose(frame: int) -> np.ndarray:
        vertices = rest.copy()
        for kx, kz, periods, steepness, phase in WAVES:
            k = 2 * np.pi * np.hypot(kx, kz)
            turn = 2 * np.pi * (uv @ (kx, kz) - periods * frame / frames) + phase
            outward = -np.sin(turn) * steepness / k
            vertices[:, 0] += outward * kx / np.hypot(kx, kz)
            vertices[:, 1] += np.cos(turn) * steepness / k
            vertices[:, 2] += outward * kz / np.hypot(kx, kz)
        return vertices

    return Scene(spec, faces, frames, pose)
