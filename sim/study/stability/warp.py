"""NVIDIA warp's mesh queries, on the CPU."""

from typing import Any

import numpy as np
import warp

from sim.study.stability.single import Single
from sim.study.stability.tracers import Found

wp: Any = warp  # its stubs do not know the fields of a query's result
wp.config.log_level = wp.LOG_ERROR

FARTHEST = 1e37
"""Largest t: as embreex has it."""


@wp.kernel
def _first(
    mesh: wp.uint64,
    farthest: float,
    origins: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    t: wp.array(dtype=float),
    triangle: wp.array(dtype=int),
):
    ray = wp.tid()
    hit = wp.mesh_query_ray(mesh, origins[ray], directions[ray], farthest)
    triangle[ray] = -1
    if hit.result:
        t[ray] = hit.t
        triangle[ray] = hit.face


class Warp(Single):
    """First hits by wp.mesh_query_ray."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray):
        super().__init__(vertices, faces)
        indices = np.ascontiguousarray(faces, np.int32).ravel()
        self._mesh = wp.Mesh(_vectors(self.vertices), wp.array(indices, dtype=int, device="cpu"))

    def first(self, origins: np.ndarray, directions: np.ndarray) -> Found:
        """All at once."""
        count = len(origins)
        t = wp.zeros(count, dtype=float, device="cpu")
        triangle = wp.zeros(count, dtype=int, device="cpu")
        rays = _vectors(origins), _vectors(directions)
        wp.launch(_first, count, [self._mesh.id, FARTHEST, *rays], [t, triangle], device="cpu")
        return Found(t.numpy().astype(np.float64), triangle.numpy().astype(np.int64))


def _vectors(of: np.ndarray) -> wp.array:
    return wp.array(np.ascontiguousarray(of, np.float32), dtype=wp.vec3, device="cpu")
