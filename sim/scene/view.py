"""The view of a mesh that fills an image and shows most of it."""

import numpy as np

from sim.scene.crop import crop
from sim.scene.visible import bounds, project, visible

FILL = 0.45
"""Share of the image that is covered at least, where any view does."""
AZIMUTHS = {40: 1.0, -40: 1.0, 65: 1.0, -65: 1.0, 0: 0.9, 90: 0.9, -90: 0.9, 140: 0.8, -140: 0.8}
"""Degrees from z towards x that views are tried from, and how good they look."""
ELEVATIONS = {18: 1.0, 35: 0.9, 4: 0.9}
"""Degrees above the horizon, y being up; likewise."""
DISTANCE = 2.6
"""From the eye to the origin, where the scene reaches as far as 1."""
MARGIN = 1.06
"""Of a view that holds all, by what it holds."""
COARSE, FINE = 64, 160
"""Cells across a scene to choose a direction, and then a part."""
CLOSER = 6
"""Times that a part of the scene is looked at more closely, until it is sure to fill."""
THINNEST = 1e-11
"""Of a window, on the plane at depth 1; what is thinner than that is not looked for."""


def axes_towards(forward: np.ndarray) -> np.ndarray:
    """Unit vectors right, down and forward (3, 3) in rows; y is up. `forward` is not 0."""
    forward = forward / np.linalg.norm(forward)
    up = np.array([0.0, 1.0, 0.0] if abs(forward[1]) < 0.9999 else [0.0, 0.0, -1.0])
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward])


def best_view(
    poses: np.ndarray, faces: np.ndarray, width: int, height: int, fill: float = FILL
) -> tuple[np.ndarray, np.ndarray]:
    """Axes (3, 3) of a view and its window (4,): left, top, right, bottom at distance 1.

    Of a few directions the one that shows most of the surface in the first pose; then the largest
    part that the first pose fills, where most of all poses is seen. That is all, if it fills.

    Parameters
    ----------
    poses : (F, V, 3) float64
        All within a distance of 1 from the origin. The eye is at -DISTANCE times forward.
    faces : (T, 3) int
        Uses all vertices.
    width, height : int
        Pixels of the image.
    fill : float
        Share of it that is covered at least, where any view does.
    """
    views = [
        (axes_towards(-_direction(azimuth, elevation)), liking * also)
        for azimuth, liking in AZIMUTHS.items()
        for elevation, also in ELEVATIONS.items()
    ]
    worth = [liking * _worth(poses[0], faces, axes, width / height, fill) for axes, liking in views]
    best = views[int(np.argmax(worth))][0]
    projected = [project(pose, best, DISTANCE) for pose in poses]
    return best, _window(projected, faces, width, height, fill)


def _worth(
    vertices: np.ndarray, faces: np.ndarray, axes: np.ndarray, aspect: float, fill: float
) -> float:
    """The surface that is shown in the part of a view that fills; next to none if nothing does."""
    projected = project(vertices, axes, DISTANCE)
    window = _around(bounds(projected))
    covered, surface = visible(projected, faces, window, COARSE, COARSE)
    _, share, shown = crop(covered, surface, window, aspect, fill)
    return shown if share >= fill else 1e-6 * shown


def _window(
    poses: list[np.ndarray], faces: np.ndarray, width: int, height: int, fill: float
) -> np.ndarray:
    """The window of an image, by the projected vertices (V, 3) of all poses."""
    each = np.array([bounds(pose) for pose in poses])
    window = _around(np.concatenate([each[:, :2].min(axis=0), each[:, 2:].max(axis=0)]))
    best, most = window, 0.0
    for _ in range(CLOSER):
        if (window[2:] - window[:2]).min() < THINNEST:
            break
        seen = [visible(pose, faces, window, FINE, FINE) for pose in poses]
        if not seen[0][0].any():  # too thin for any cell: towards the largest triangle
            window = _grown(window, 1 / FINE) - np.tile(_middle(window), 2)
            window += np.tile(_largest(poses[0], faces), 2)
            continue
        shown = np.mean([surface for _, surface in seen], axis=0)
        part, share, _ = crop(seen[0][0], shown, window, width / height, fill)
        covered, _ = visible(poses[0], faces, part, min(width, FINE), min(height, FINE))
        if covered.mean() > most:
            best, most = part, covered.mean()
        if most >= fill:
            break
        window = _grown(part, 1.5)
    if most > 0:
        return best
    # Nothing has an area to be seen: the image holds the ball in which all of it is.
    half = np.array([max(width / height, 1.0), max(height / width, 1.0)])
    half *= MARGIN / np.sqrt(DISTANCE**2 - 1)
    return np.concatenate([-half, half])


def _direction(azimuth: float, elevation: float) -> np.ndarray:
    a, e = np.radians([azimuth, elevation])
    return np.array([np.sin(a) * np.cos(e), np.sin(e), np.cos(a) * np.cos(e)])


def _around(window: np.ndarray) -> np.ndarray:
    """A window with a margin, and an area if it had none."""
    return _grown(window, MARGIN) + THINNEST * np.array([-1.0, -1.0, 1.0, 1.0])


def _grown(window: np.ndarray, factor: float) -> np.ndarray:
    half = (window[2:] - window[:2]) / 2 * factor
    return np.concatenate([_middle(window) - half, _middle(window) + half])


def _middle(window: np.ndarray) -> np.ndarray:
    return (window[:2] + window[2:]) / 2


def _largest(projected: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """The middle (2,) of the triangle that is largest on the plane."""
    corner = projected[faces, :2]
    (ax, ay), (bx, by) = (np.moveaxis(corner[:, k] - corner[:, 0], 1, 0) for k in (1, 2))
    return corner[np.abs(ax * by - ay * bx).argmax()].mean(axis=0)
