"""Errors of an image against one in which nothing is rounded."""

import numpy as np

from sim.model.fp.format import decode
from sim.model.rays.camera import Rays
from sim.oracle.trace import trace
from sim.prepare import Prepared
from sim.scene.camera import Camera
from sim.study.precision.errors import errors, silhouettes


def against_truth(
    prepared: Prepared, camera: Camera, pose: np.ndarray, rays: Rays, hits: dict[str, np.ndarray]
) -> dict:
    """Errors of the hits of a camera's rays, whose pixels the oracle traces in float64.

    `pose` is that of the normalised scene. Of sim.study.precision.errors.
    """
    shape = camera.height, camera.width
    y, x = np.indices(shape).reshape(2, -1, 1)
    directions = camera.corner + x * camera.right + y * camera.down
    zero, inf = np.zeros(len(directions)), np.full(len(directions), np.inf)
    origins = np.broadcast_to(camera.origin, directions.shape)
    truth = trace(pose, prepared.surface_faces, origins, directions, zero, inf)
    true_triangle, true_t = truth.triangle.reshape(shape), truth.t.reshape(shape)

    inside = rays.pixels >= 0
    ray_of = np.empty(len(directions), np.int64)
    ray_of[rays.pixels[inside]] = np.flatnonzero(inside)
    triangle = prepared.surfaces(hits)[ray_of].reshape(shape)
    t = decode(prepared.config.fmt, hits["t"][ray_of]).reshape(shape)
    pixel = float(np.linalg.norm(camera.right))
    edges = silhouettes(true_triangle, true_t, pixel)  # t is depth: directions have length 1 there
    return errors(triangle, t, true_triangle, true_t, edges)
