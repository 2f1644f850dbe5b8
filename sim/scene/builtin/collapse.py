"""`collapse`: a sphere that falls into a point, and comes back."""

import numpy as np

from sim.scene.builtin.shapes import SMALLEST_SPHERE, check_size, sphere
from sim.scene.scene import Scene

POINT = np.array([0.3, 0.2, 0.1])
"""Where it falls to: no centre of anything, and no number that a float holds exactly."""
ARMS = 5


def collapse(spec: str, triangles: int, frames: int) -> Scene:
    """A unit sphere of which all vertices are exactly equal in the middle of the period.

    A vertex is at distance |1 - 2 time|^p of the point, p from 1 to 5: as it shrinks the sphere
    grows arms, and near the point some vertices move 1e3 to 1e6 times as fast as others. An odd
    number of frames has none in the middle. Frame 0 is the sphere.
    """
    check_size(spec, triangles, SMALLEST_SPHERE)
    points, faces = sphere(triangles)
    flat = np.hypot(points[:, 0], points[:, 2])
    powers = 3 + 2 * flat * np.sin(ARMS * np.arctan2(points[:, 2], points[:, 0]))

    def pose(frame: int) -> np.ndarray:
        left = abs(frames - 2 * frame) / frames
        return POINT + left ** powers[:, np.newaxis] * (points - POINT)

    return Scene(spec, faces, frames, pose)
