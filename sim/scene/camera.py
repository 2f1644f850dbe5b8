"""Where a picture is taken from: pinhole cameras, given or chosen to fill the image."""

from dataclasses import dataclass

import numpy as np

from sim.errors import InputError
from sim.scene.view import DISTANCE, FILL, axes_towards, best_view


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: the ray of pixel (x, y) has direction corner + x right + y down.

    Attributes
    ----------
    origin, corner, right, down : (3,) float64
        In the coordinates of the points that the camera was made from. corner is the direction
        of pixel (0, 0)'s centre, right and down go from pixel to pixel. They are square to each
        other and to the axis, along which all directions have length 1.
    width, height : int
        Pixels.
    """

    origin: np.ndarray
    corner: np.ndarray
    right: np.ndarray
    down: np.ndarray
    width: int
    height: int


def look_at(eye, target, fov: float, width: int, height: int) -> Camera:
    """A camera at a point, towards another, y up; `fov` is of the height, in degrees.

    Raises
    ------
    InputError
        There is no direction, no angle or no pixel.
    """
    eye, target = np.asarray(eye, np.float64), np.asarray(target, np.float64)
    _check_image(width, height)
    if not 0 < fov < 180:
        raise InputError(f"camera: the field of view is above 0 and below 180 degrees, not {fov:g}")
    if not (np.isfinite(eye).all() and np.isfinite(target).all()):
        raise InputError("camera: eye or target is not finite; give finite numbers")
    scale = max(np.abs(eye).max(), np.abs(target).max(), np.finfo(np.float64).tiny)
    forward = target / scale - eye / scale
    if not forward.any():
        raise InputError("camera: eye and target are the same point; move one")
    high = np.tan(np.radians(fov) / 2)
    wide = high * width / height
    return _camera(eye, axes_towards(forward), np.array([-wide, -high, wide, high]), width, height)


def parse(text: str) -> tuple[np.ndarray, np.ndarray, float]:
    """Eye, target and field of view in degrees of `ex,ey,ez,tx,ty,tz,fov`.

    Eye and target are points of the source scene: `Normalised.points` takes them to where
    `look_at` is to make a camera for a machine.

    Raises
    ------
    InputError
        The text is not seven finite numbers.
    """
    try:
        numbers = np.array([float(part) for part in text.split(",")])
    except ValueError:
        numbers = np.empty(0)
    if len(numbers) != 7 or not np.isfinite(numbers).all():
        raise InputError(
            f"--camera {text}: give auto, whole, or seven finite numbers ex,ey,ez,tx,ty,tz,fov"
        )
    return numbers[:3], numbers[3:6], float(numbers[6])


def auto(
    poses: np.ndarray, faces: np.ndarray, width: int, height: int, fill: float = FILL
) -> Camera:
    """A camera from which a mesh fills the image: at least `fill` of it, if any view does.

    It shows all of all poses if that fills, else the part that shows most; see `view.best_view`.

    Parameters
    ----------
    poses : (F, V, 3) float64
        Finite. A few poses of an animation; y is up, and a figure looks along z.
    faces : (T, 3) int
    width, height : int
    fill : float
        With 0 all of all poses is in the image.

    Raises
    ------
    InputError
        The image has no pixel.
    """
    _check_image(width, height)
    used, place = np.unique(faces, return_inverse=True)
    poses = poses[:, used]
    # axis by axis: numpy is slow at minima over all but a short last axis
    low, high = (np.array([end(poses[:, :, k]) for k in range(3)]) for end in (np.min, np.max))
    centre, radius = low / 2 + high / 2, float(np.linalg.norm(high / 2 - low / 2))
    largest = float(np.abs(centre).max())
    if radius <= 1e-9 * largest or radius == 0:  # as good as a point: as if it had a size
        radius = largest or 1.0
    unit = (poses - centre) / radius
    axes, window = best_view(unit, place.reshape(-1, 3), width, height, fill)
    return _camera(centre - radius * DISTANCE * axes[2], axes, window, width, height)


def _camera(origin, axes, window, width: int, height: int) -> Camera:
    """A camera whose image is a window: left, top, right, bottom at distance 1."""
    pixel = (window[2:] - window[:2]) / (width, height)
    right, down = pixel[0] * axes[0], pixel[1] * axes[1]
    corner = axes[2] + window[0] * axes[0] + window[1] * axes[1] + (right + down) / 2
    return Camera(origin, corner, right, down, width, height)


def _check_image(width: int, height: int):
    if width < 1 or height < 1:
        raise InputError(f"an image of {width} x {height} pixels: both are at least 1")
