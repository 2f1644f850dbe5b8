"""Simple meshes of any size.

Each is vertices (V, 3) float64 (a grid's are (V, 2)) and faces (T, 3) int32.
"""

import numpy as np

from sim.errors import InputError

SMALLEST_SPHERE = 6  # triangles


def check_size(spec: str, triangles: int, smallest: int) -> None:
    """Raise the error for a size below the smallest that a figure can have."""
    if triangles < smallest:
        raise InputError(f"{spec}: {triangles} triangles are too few; {smallest} is the smallest")


def split_quads(quads: np.ndarray) -> np.ndarray:
    """Two triangles for each quad (..., 4), with its orientation."""
    return quads[..., [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3).astype(np.int32)


def grid(across: int, along: int) -> tuple[np.ndarray, np.ndarray]:
    """The unit square in across x along cells: 2 * across * along triangles.

    Vertex (i, j) is number i * (along + 1) + j. With x to the right and z towards the viewer
    the front is up.
    """
    u, v = np.meshgrid(np.arange(across + 1) / across, np.arange(along + 1) / along, indexing="ij")
    i, j = np.meshgrid(np.arange(across), np.arange(along), indexing="ij")
    corner = i * (along + 1) + j
    quads = np.stack([corner, corner + 1, corner + along + 2, corner + along + 1], axis=-1)
    return np.stack([u.ravel(), v.ravel()], axis=1), split_quads(quads)


def sphere(triangles: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed unit sphere of about `triangles` triangles in rings of latitude, poles on y.

    n sectors and m rings between the poles make 2 * n * m triangles.
    """
    m = max(1, round((triangles / 4) ** 0.5))
    n = max(3, round(triangles / (2 * m)))
    polar = np.pi * np.arange(1, m + 1) / (m + 1)
    around = 2 * np.pi * np.arange(n) / n
    ring = np.stack([np.cos(around), np.zeros(n), np.sin(around)], axis=1)
    up = np.array([0.0, 1.0, 0.0])
    rings = np.sin(polar)[:, None, None] * ring + np.cos(polar)[:, None, None] * up
    vertices = np.concatenate([[up], rings.reshape(-1, 3), [-up]])

    i, j = np.meshgrid(np.arange(m - 1), np.arange(n), indexing="ij")
    here, right = 1 + i * n + j, 1 + i * n + (j + 1) % n
    belt = split_quads(np.stack([here, right, right + n, here + n], axis=-1))
    j = np.arange(n)
    first, last = 1 + j, 1 + (m - 1) * n + j
    top = np.stack([np.zeros(n, int), 1 + (j + 1) % n, first], axis=1)
    bottom = np.stack([np.full(n, len(vertices) - 1), last, 1 + (m - 1) * n + (j + 1) % n], axis=1)
    return vertices, np.concatenate([top, belt, bottom]).astype(np.int32)
