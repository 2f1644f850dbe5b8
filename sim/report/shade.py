"""From hits to colours."""

import numpy as np

from sim.report.light import light
from sim.report.normals import smooth_normals
from sim.report.parts import tints
from sim.report.seen import Seen, unit

# Colours are linear and may be above 1 until they are shown.
SKY_TOP, SKY_BOTTOM = np.array([0.20, 0.27, 0.36]), np.array([0.76, 0.79, 0.79])
KEY = np.array([1.12, 1.04, 0.92])
FILL, FILL_FROM = np.array([0.07, 0.09, 0.13]), np.array([0.9, 0.1, 0.4])  # right, up, backward
ABOVE, BELOW = np.array([0.25, 0.29, 0.35]), np.array([0.14, 0.115, 0.10])  # from all round
GLOSS, SHININESS = 0.08, 24
RIM = 0.25
VIEWS = ("shaded", "normal", "depth")
DARKEST, BRIGHTEST = 22.0, 97.0
"""CIE lightness of the farthest and of the nearest depth."""


def shade(
    seen: Seen,
    view: str = "shaded",
    *,
    lit: np.ndarray | None = None,
    lamp: np.ndarray | None = None,
    colours: np.ndarray | None = None,
    depths: tuple[float, float] | None = None,
) -> np.ndarray:
    """The picture (height, width, 3) uint8, sRGB.

    Parameters
    ----------
    seen : Seen
    view : str
        One of VIEWS. shaded: by a lamp, under a sky. normal: the camera's right, up and backward
        in red, green and blue, -1 as 0 and 1 as 255. depth: along the camera's axis, near is
        bright, equal steps in depth are equal to the eye. The last two are black where nothing
        is hit.
    lit : (height, width) bool
        Pixels that the lamp reaches, for the shaded view; all if not given.
    lamp, colours, depths
        Where the lamp is (3,), linear colours (T, 3) of the triangles, for the shaded view; the t
        of the brightest and of the darkest depth. If not given, `light.light` and `parts.tints` of
        these vertices and what the hits span: an animation has to give them, or they waver.
    """
    if view == "shaded":
        lamp = light(seen.camera, seen.vertices) if lamp is None else lamp
        colours = tints(seen.vertices, seen.faces) if colours is None else colours
        shown = _shaded(seen, lit, lamp, colours[seen.triangle[seen.hit]])
        height = np.linspace(0, 1, len(seen.hit))[:, None, None]
        background = _encoded(SKY_TOP + (SKY_BOTTOM - SKY_TOP) * height)
    elif view == "normal":
        shown, background = (smooth_normals(seen) @ _axes(seen).T + 1) / 2, np.zeros(3)
    else:
        shown, background = _depth(seen.t[seen.hit], depths), np.zeros(3)
    picture = np.broadcast_to(background, (*seen.hit.shape, 3)).copy()
    picture[seen.hit] = shown
    return np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)


def _shaded(seen: Seen, lit, lamp, colour):
    """Colours (n, 3) under the lamp, where that reaches, and under all that is round about."""
    normal = smooth_normals(seen)
    to_lamp = unit(lamp - seen.points)
    reached = np.ones((len(normal), 1)) if lit is None else lit[seen.hit][:, None]
    key = np.maximum(_dot(normal, to_lamp), 0) * reached
    fill = np.maximum(_dot(normal, unit(FILL_FROM @ _axes(seen))), 0)
    height = (1 + normal[:, 1:2]) / 2
    gloss = np.maximum(_dot(normal, unit(to_lamp + seen.towards_eye)), 0) ** SHININESS
    rim = (1 - np.clip(_dot(normal, seen.towards_eye), 0, 1)) ** 4

    shown = colour * (key * KEY + fill * FILL + height * ABOVE + (1 - height) * BELOW)
    # the gloss ends where the lamp does, but not at once
    shown += GLOSS * gloss * np.minimum(4 * key, 1) * KEY + RIM * rim * ABOVE
    return _encoded(shown)


def _depth(t: np.ndarray, depths: tuple[float, float] | None):
    """Greys (n, 3). All directions are as long along the camera's axis: depth goes by t."""
    if depths is None:
        depths = (t.min(), t.max()) if len(t) else (0.0, 0.0)
    near, far = depths
    nearness = np.clip((far - t) / (far - near), 0, 1) if far > near else np.ones(len(t))
    lightness = DARKEST + (BRIGHTEST - DARKEST) * nearness
    luminance = ((lightness + 16) / 116) ** 3
    return _encoded(np.repeat(luminance[:, None], 3, axis=1))


def _axes(seen: Seen) -> np.ndarray:
    """The camera's right, up and backward (3, 3) in rows."""
    right, down = unit(seen.camera.right), unit(seen.camera.down)
    return np.stack([right, -down, np.cross(down, right)])


def _dot(vectors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Products (n, 1)."""
    return (vectors * others).sum(axis=1, keepdims=True)


def _encoded(linear: np.ndarray) -> np.ndarray:
    """As sRGB, not yet cut off at 1."""
    linear = np.maximum(linear, 0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
