"""Rotations."""

import numpy as np


def rotations(axes: np.ndarray, angles: np.ndarray | float) -> np.ndarray:
    """Matrices (..., 3, 3) that turn by `angles` (...) radians about unit `axes` (..., 3).

    Rodrigues' formula; counterclockwise as seen from the axis' tip.
    """
    angles = np.asarray(angles)[..., np.newaxis, np.newaxis]
    x, y, z = np.moveaxis(np.asarray(axes, np.float64), -1, 0)
    o = np.zeros_like(x)
    cross = np.stack([o, -z, y, z, o, -x, -y, x, o], axis=-1).reshape(*x.shape, 3, 3)
    return np.eye(3) + np.sin(angles) * cross + (1 - np.cos(angles)) * (cross @ cross)
