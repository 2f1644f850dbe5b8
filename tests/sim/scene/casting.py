"""Rays by brute force in float64, triangle after triangle: for meshes of a few."""

import numpy as np


def directions(camera) -> np.ndarray:
    """Of all pixels (height, width, 3)."""
    y, x = np.mgrid[0 : camera.height, 0 : camera.width]
    return camera.corner + x[..., None] * camera.right + y[..., None] * camera.down


def cast(camera, vertices, faces):
    """t, u, v and triangle (height, width) of the first hits; -1 where there is none."""
    t, u, v, triangle = intersect(camera.origin, directions(camera).reshape(-1, 3), vertices, faces)
    shape = (camera.height, camera.width)
    return t.reshape(shape), u.reshape(shape), v.reshape(shape), triangle.reshape(shape)


def intersect(origins, rays, vertices, faces, t_max=np.inf):
    """t, u, v and triangle (n,) of the first hits of rays (n, 3)."""
    best = np.full(len(rays), t_max)
    u_best, v_best, triangle = np.zeros(len(rays)), np.zeros(len(rays)), np.full(len(rays), -1)
    for index, (a, b, c) in enumerate(vertices[faces]):
        normal = np.cross(rays, c - a)
        volume = normal @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = ((origins - a) * normal).sum(axis=-1) / volume
            across = np.cross(origins - a, b - a)
            v = (rays * across).sum(axis=-1) / volume
            t = (across @ (c - a)) / volume
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (t < best)
        for array, value in ((best, t), (u_best, u), (v_best, v), (triangle, index)):
            array[hit] = value[hit] if isinstance(value, np.ndarray) else value
    return best, u_best, v_best, triangle


def project(camera, points) -> np.ndarray:
    """Column, row and depth (..., 3) of points; a ray of the camera has depth 1 at t = 1."""
    axes = np.stack([camera.right, camera.down, camera.corner], axis=1)
    solved = np.linalg.solve(axes, np.moveaxis(points - camera.origin, -1, 0).reshape(3, -1)).T
    x, y, depth = solved.reshape(points.shape)[..., :].T
    return np.stack([x / depth, y / depth, depth], axis=-1)
