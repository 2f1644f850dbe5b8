"""A scene: a mesh of constant topology whose vertices move."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Scene:
    """A triangle mesh and its motion.

    Attributes
    ----------
    name : str
        What reports call it.
    faces : (T, 3) int32
        Vertex indices of each triangle, T >= 1.
    frames : int
        Number of frames, at least 1.
    pose : callable, frame -> (V, 3) float64
        Vertex positions of a frame, 0 <= frame < frames. All finite.
    """

    name: str
    faces: np.ndarray
    frames: int
    pose: Callable[[int], np.ndarray]
