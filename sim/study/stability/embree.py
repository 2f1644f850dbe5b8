"""Embree, by embreex."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from sim.study.stability.single import Single
from sim.study.stability.tracers import Found


class Embree(Single):
    """Embree's first hits; `robust` sets RTC_SCENE_FLAG_ROBUST."""

    def __init__(self, robust: bool, vertices: np.ndarray, faces: np.ndarray):
        super().__init__(vertices, faces)
        self._scene = EmbreeScene(robust=robust)
        TriangleMesh(self._scene, self.vertices.astype(np.float32), np.asarray(faces, np.int32))

    def first(self, origins: np.ndarray, directions: np.ndarray) -> Found:
        """With its own limits of t: 0 to 1e37."""
        rays = [np.ascontiguousarray(x, np.float32) for x in (origins, directions)]
        hits = self._scene.run(*rays, query="INTERSECT", output=True)
        return Found(hits["tfar"].astype(np.float64), hits["primID"].astype(np.int64))
