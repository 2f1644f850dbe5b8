"""What peers have in common: they hold float32, in the user's coordinates."""

import numpy as np


class Single:
    """Points and directions of a system that rounds to float32."""

    def __init__(self, vertices: np.ndarray, faces: np.ndarray):
        self.vertices = self.points(vertices)
        self.rank = np.arange(len(faces))

    def points(self, points: np.ndarray) -> np.ndarray:
        """Rounded once; what is beyond float32 becomes infinite."""
        with np.errstate(over="ignore", under="ignore"):
            return np.asarray(points, np.float32).astype(np.float64)

    def directions(self, directions: np.ndarray) -> np.ndarray:
        """Rounded once."""
        return self.points(directions)
