"""The lamp of a picture, and the rays that find what lies in its shadow."""

import numpy as np

from sim.report.seen import Seen, unit
from sim.scene.camera import Camera

ASIDE, ABOVE = 0.5, 0.6
"""Of the lamp, to the left of the camera and above it, in distances from it to the scene."""


def light(camera: Camera, vertices: np.ndarray) -> np.ndarray:
    """Where the lamp is (3,): to the upper left of the camera, about as far from the vertices."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    distance = np.linalg.norm(low / 2 + high / 2 - camera.origin)
    return camera.origin - distance * (ASIDE * unit(camera.right) + ABOVE * unit(camera.down))


def shadow_rays(seen: Seen, lamp: np.ndarray, offset: float) -> tuple[np.ndarray, np.ndarray]:
    """Rays from the hits to the lamp: origins (n, 3), and directions (n, 3) that reach it at t = 1.

    What such a ray hits with 0 <= t <= 1 casts a shadow: `lit = seen.hit.copy();
    lit[lit] = ~shadowed`.

    Parameters
    ----------
    seen : Seen
    lamp : (3,) float64
    offset : float
        Of the origins off their triangles, towards the camera, as a share of the largest
        coordinate of the vertices: above what rounding moves a hit by, or the mesh is covered
        in its own shadow; below what is to cast one.
    """
    step = offset * np.abs(seen.vertices).max()
    origins = seen.points + step * seen.flat_normals
    return origins, lamp - origins
