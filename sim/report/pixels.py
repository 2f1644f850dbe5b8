"""Between cameras, pixels and rays in bit patterns."""

import numpy as np

from hdl.fp.format import FloatFormat
from hdl.rays.packet import NO_TRIANGLE, RAYS
from sim.compiler.rays import View
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays, camera
from sim.report.light import shadow_rays
from sim.report.seen import Seen
from sim.scene.camera import Camera

SHADOW_ULPS = 128
"""Half ulps of the largest coordinate by which shadow rays start off their surface."""


def camera_rays(fmt: FloatFormat, view: View) -> Rays:
    """The rays that the hardware makes of a view."""
    vectors = view.origin, view.corner, view.right, view.down
    return camera(fmt, *vectors, view.width, view.height, view.t_min, view.t_max, view.top)


def seen_by(
    camera: Camera,
    vertices: np.ndarray,
    faces: np.ndarray,
    fmt: FloatFormat,
    rays: Rays,
    hits: dict[str, np.ndarray],
) -> Seen:
    """What the pixels of a camera see, from the hits of its rays; faces by triangle record."""
    inside = rays.pixels >= 0
    shape = camera.height, camera.width

    def image(values, dtype):
        flat = np.zeros(camera.height * camera.width, dtype)
        flat[rays.pixels[inside]] = values[inside]
        return flat.reshape(shape)

    t, u, v = (image(decode(fmt, hits[name]), np.float64) for name in "tuv")
    triangle = np.where(hits["triangle"] == NO_TRIANGLE, -1, hits["triangle"])
    return Seen(camera, vertices, faces, t, u, v, image(triangle, np.int64))


def shadow_rays_of(seen: Seen, lamp: np.ndarray, fmt: FloatFormat, rays: Rays) -> Rays:
    """Rays from what is seen to the lamp, in the packets of the camera's rays.

    Packets of which no ray hits are left out; a ray that does not hit is there with t_min above
    t_max. What they hit casts a shadow.
    """
    origins, directions = shadow_rays(seen, lamp, SHADOW_ULPS * 2.0 ** -(fmt.man_bits + 1))
    row = np.full(seen.hit.size, -1)
    row[seen.hit.ravel()] = np.arange(len(origins))
    rows = np.where(rays.pixels >= 0, row[rays.pixels], -1)
    packets = rows.reshape(-1, RAYS)
    kept = (packets >= 0).any(axis=1)
    rows, pixels = packets[kept].ravel(), rays.pixels.reshape(-1, RAYS)[kept].ravel()
    there = rows >= 0
    if not len(origins):
        origins = directions = np.zeros((1, 3))
    return Rays(
        origins=encode(fmt, origins)[rows],
        directions=encode(fmt, directions)[rows],
        t_min=np.where(there, encode(fmt, 0.0), encode(fmt, np.inf)),
        t_max=np.where(there, encode(fmt, 1.0), encode(fmt, -np.inf)),
        pixels=np.where(there, pixels, -1),
    )


def lit_by(seen: Seen, rays: Rays, hits: dict[str, np.ndarray]) -> np.ndarray:
    """Pixels (height, width) that the lamp reaches, from the hits of shadow rays."""
    lit = seen.hit.copy()
    dark = (rays.pixels >= 0) & (hits["triangle"] != NO_TRIANGLE)
    lit.ravel()[rays.pixels[dark]] = False
    return lit
