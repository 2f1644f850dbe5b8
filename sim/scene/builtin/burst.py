"""`burst`: a sphere that flies to pieces."""

import numpy as np

from sim.scene.builtin.shapes import SMALLEST_SPHERE, check_size, sphere
from sim.scene.scene import Scene


def burst(spec: str, triangles: int, frames: int) -> Scene:
    """A unit sphere whose triangles fly apart, each tumbling its own random way.

    Neighbours do not stay neighbours: the case in which updating the bounds of a tree that was
    built over the first frame is worth least. No vertex is shared. Frame 0 is the whole sphere,
    the last frame the widest cloud, a few radii across.
    """
    check_size(spec, triangles, SMALLEST_SPHERE)
    points, faces = sphere(triangles)
    corners = points[faces]
    centres = corners.mean(axis=1, keepdims=True)
    offsets = corners - centres

    rng = np.random.default_rng(2006)
    directions = rng.normal(size=(2, len(faces), 1, 3))
    way, axis = directions / np.linalg.norm(directions, axis=3, keepdims=True)
    way *= rng.uniform(0.3, 3.0, (len(faces), 1, 1))
    turns = rng.uniform(-1.5, 1.5, (len(faces), 1, 1))
    # a turn about an axis, by Rodrigues' formula
    across = np.cross(axis, offsets)
    along = (offsets * axis).sum(axis=2, keepdims=True) * axis

    def pose(frame: int) -> np.ndarray:
        time = frame / frames
        angle = 2 * np.pi * time * turns
        turned = np.cos(angle) * offsets + np.sin(angle) * across + (1 - np.cos(angle)) * along
        return (centres + time * way + turned).reshape(-1, 3)

    separate = np.arange(3 * len(faces), dtype=np.int32).reshape(-1, 3)
    return Scene(spec, separate, frames, pose)
