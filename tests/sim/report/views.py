"""What cameras see of meshes of a few triangles, by brute force."""

import numpy as np

from sim.report.seen import Seen
from sim.scene.camera import look_at
from tests.sim.scene.casting import cast

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
CUBE_FACES = np.array([
    (a, *pair)
    for a, b, c, d in [
        (0, 2, 6, 4),
        (0, 1, 3, 2),
        (4, 6, 7, 5),
        (0, 4, 5, 1),
        (2, 3, 7, 6),
        (1, 5, 7, 3),
    ]
    for pair in ((b, c), (c, d))
])
SQUARE = np.array([[0, 1, 2], [0, 2, 3]])


def square(points) -> tuple[np.ndarray, np.ndarray]:
    return np.array(points, np.float64), SQUARE


def wall(z: float, half: float = 1.0) -> np.ndarray:
    """Corners of a square that faces z."""
    return np.array([[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]])


def joined(*meshes) -> tuple[np.ndarray, np.ndarray]:
    starts = np.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    faces = [faces + start for (_, faces), start in zip(meshes, starts, strict=False)]
    return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)


def seen_from(eye, mesh, fov=40.0, width=40, height=30, target=(0, 0, 0)) -> Seen:
    vertices, faces = mesh
    camera = look_at(eye, target, fov, width, height)
    return Seen(camera, vertices, faces, *cast(camera, vertices, faces))
