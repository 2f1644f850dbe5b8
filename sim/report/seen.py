"""What each pixel of an image sees, on the triangles themselves."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim.scene.camera import Camera


@dataclass(frozen=True)
class Seen:
    """The hits of an image and what they lie on.

    Attributes
    ----------
    camera : Camera
    vertices : (V, 3) float64
        In the camera's coordinates.
    faces : (T, 3) int
    t, u, v : (height, width) float64
        Of the hits; t is in directions of the camera, u and v weigh vertices 1 and 2.
    triangle : (height, width) int
        Row of faces, or -1 where the ray hits nothing; t, u and v do not count there.
    """

    camera: Camera
    vertices: np.ndarray
    faces: np.ndarray
    t: np.ndarray
    u: np.ndarray
    v: np.ndarray
    triangle: np.ndarray

    @cached_property
    def hit(self) -> np.ndarray:
        """Pixels (height, width) that see the mesh: n of them, which all below go by, in rows."""
        return self.triangle >= 0

    @cached_property
    def weights(self) -> np.ndarray:
        """Of the three corners (n, 3)."""
        u, v = self.u[self.hit], self.v[self.hit]
        return np.stack([1 - u - v, u, v], axis=1)

    @cached_property
    def corners(self) -> np.ndarray:
        """Vertices (n, 3) of the triangles."""
        return self.faces[self.triangle[self.hit]]

    @cached_property
    def points(self) -> np.ndarray:
        """Where the hits are (n, 3): on the triangles, which t is not as sure of."""
        return (self.weights[:, :, None] * self.vertices[self.corners]).sum(axis=1)

    @cached_property
    def towards_eye(self) -> np.ndarray:
        """Unit vectors (n, 3) to the camera."""
        return unit(self.camera.origin - self.points)

    @cached_property
    def flat_normals(self) -> np.ndarray:
        """Unit normals (n, 3) of the triangles, on the side of the camera."""
        a, b, c = np.moveaxis(self.vertices[self.corners], 1, 0)
        return facing(unit(np.cross(b - a, c - a)), self.towards_eye)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) at length 1; 0 stays 0."""
    largest = np.abs(vectors).max(axis=-1, keepdims=True)
    scaled = vectors / np.where(largest > 0, largest, 1)  # so that squares stay in range
    length = np.linalg.norm(scaled, axis=-1, keepdims=True)
    return scaled / np.where(length > 0, length, 1)


def facing(normals: np.ndarray, side: np.ndarray) -> np.ndarray:
    """Normals (n, 3), turned round where they point away from a side (n, 3)."""
    return np.where((normals * side).sum(axis=1, keepdims=True) < 0, -normals, normals)
