"""Linear blend skinning."""

import numpy as np


def skin(
    vertices: np.ndarray, joints: np.ndarray, weights: np.ndarray, matrices: np.ndarray
) -> np.ndarray:
    """Vertices (V, 3) moved by the weighted mean of their joints' matrices.

    Parameters
    ----------
    vertices : (V, 3) float64
        At rest.
    joints, weights : (V, K)
        The joints that move each vertex, and by how much; a vertex' weights sum to 1.
    matrices : (J, 4, 4) float64
        Each joint's motion from rest, acting on columns.

    """
    blended = np.zeros((len(vertices), 3, 4))
    for joint, weight in zip(joints.T, weights.T, strict=True):
        blended += weight[:, np.newaxis, np.newaxis] * matrices[joint, :3]
    return (blended[:, :, :3] @ vertices[:, :, np.newaxis])[:, :, 0] + blended[:, :, 3]
