"""Bringing a scene into [-1, 1] without rounding more than once."""

from dataclasses import dataclass

import numpy as np

from sim.errors import InputError
from sim.scene.check import check_finite
from sim.scene.scene import Scene


@dataclass(frozen=True)
class Normalised:
    """A scene in [-1, 1] and the way there.

    Attributes
    ----------
    scene : Scene
        Poses are normalised; frames keep the numbers they have in the source.
    frames : range
        The frames that were asked for: only these are sure to lie in [-1, 1].
    centre : (3,) float64
        Point of the source that becomes the origin.
    exponent : int
        One unit of the normalised scene is 2**exponent units of the source.
    """

    scene: Scene
    frames: range
    centre: np.ndarray
    exponent: int

    def points(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the source in normalised coordinates.

        Rounds once, in the subtraction; the scale is exact while the result is no subnormal.
        """
        return np.ldexp(points - self.centre, -self.exponent)

    def source_points(self, points: np.ndarray) -> np.ndarray:
        """Normalised points (..., 3) in coordinates of the source."""
        return np.ldexp(points, self.exponent) + self.centre


def normalise(scene: Scene, frames: range | None = None) -> Normalised:
    """Move the centre of the bounding box of all `frames` to 0 and scale by a power of two.

    The largest coordinate of all frames then lies in (0.5, 1], or is 0 where all vertices
    coincide (the exponent is 0 then). Works at any magnitude that float64 has.
    """
    frames = range(scene.frames) if frames is None else frames
    if len(frames) == 0:
        raise InputError(f"{scene.name}: no frame chosen; it has frames 0 to {scene.frames - 1}")
    for frame in (frames[0], frames[-1]):
        if not 0 <= frame < scene.frames:
            raise InputError(
                f"{scene.name}: has no frame {frame}; frames are 0 to {scene.frames - 1}"
            )
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for frame in frames:
        vertices = scene.pose(frame)
        check_finite(scene.name, frame, vertices)
        low = np.minimum(low, vertices.min(axis=0))
        high = np.maximum(high, vertices.max(axis=0))

    # Halves are added, as the sum or the difference of the ends may overflow. Halving rounds
    # subnormals: the clip keeps a point's centre at that point.
    centre = np.clip(low / 2 + high / 2, low, high) + 0.0
    extent = max((high - centre).max(), (centre - low).max())
    mantissa, exponent = np.frexp(extent)
    exponent = int(exponent) - (1 if mantissa == 0.5 else 0)  # 0.5 itself becomes 1

    def pose(frame: int) -> np.ndarray:
        return normalised.points(scene.pose(frame))

    unit = Scene(scene.name, scene.faces, scene.frames, pose)
    normalised = Normalised(unit, frames, centre, exponent)
    return normalised
