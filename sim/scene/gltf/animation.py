"""glTF animations: what a node's properties are at a time."""

from dataclasses import dataclass

import numpy as np

from sim.errors import InputError
from sim.scene.gltf.document import Document


@dataclass(frozen=True)
class Channel:
    """One property of one node over time (glTF 2.0, 3.11 and appendix C).

    Attributes
    ----------
    node : int
    path : str
        translation, rotation, scale or weights.
    interpolation : str
        STEP, LINEAR or CUBICSPLINE.
    times : (K,) float64
        Seconds, ascending.
    values : (K, W) float64
        With CUBICSPLINE (K, 3, W): tangent in, value, tangent out.
    """

    node: int
    path: str
    interpolation: str
    times: np.ndarray
    values: np.ndarray

    def at(self, time: float) -> np.ndarray:
        """The property (W,) at a time in seconds; before and after all keys it stays."""
        values = self.values[:, 1] if self.interpolation == "CUBICSPLINE" else self.values
        key = int(np.searchsorted(self.times, time, side="right")) - 1
        if key < 0 or key == len(self.times) - 1:
            return self._unit(values[max(key, 0)])
        span = self.times[key + 1] - self.times[key]
        s = (time - self.times[key]) / span
        if self.interpolation == "STEP":
            return self._unit(values[key])
        if self.interpolation == "CUBICSPLINE":
            leaving, arriving = self.values[key, 2], self.values[key + 1, 0]
            return self._unit(
                (2 * s**3 - 3 * s**2 + 1) * values[key]
                + (s**3 - 2 * s**2 + s) * span * leaving
                + (3 * s**2 - 2 * s**3) * values[key + 1]
                + (s**3 - s**2) * span * arriving
            )
        if self.path == "rotation":
            return slerp(values[key], values[key + 1], s)
        return (1 - s) * values[key] + s * values[key + 1]

    def _unit(self, value: np.ndarray) -> np.ndarray:
        return value / np.linalg.norm(value) if self.path == "rotation" else value


def slerp(a: np.ndarray, b: np.ndarray, s: float) -> np.ndarray:
    """The rotation (x, y, z, w) at `s` on the shorter way from a to b."""
    cosine = float(a @ b)
    b = b if cosine >= 0 else -b
    angle = np.arccos(min(abs(cosine), 1.0))
    if angle < 1e-6:
        mixed = (1 - s) * a + s * b
    else:
        mixed = np.sin((1 - s) * angle) * a + np.sin(s * angle) * b
    return mixed / np.linalg.norm(mixed)


def channels(document: Document, animation: str | None) -> list[Channel]:
    """The channels of the animation with this name or number; of the first one if not given.

    Raises
    ------
    InputError
        There is no such animation; names those that exist.
    """
    animations = document.gltf["animations"]
    if not animations and animation is None:
        return []
    names = [entry.get("name", "") for entry in animations]
    if animation is None:
        chosen = animations[0]
    elif animation in names:
        chosen = animations[names.index(animation)]
    elif animation.isdecimal() and int(animation) < len(animations):
        chosen = animations[int(animation)]
    else:
        known = ", ".join(f"{k} {name!r}" for k, name in enumerate(names)) or "none"
        raise InputError(f"{document.path}: no animation {animation!r}; it has: {known}")
    found = []
    for channel in chosen["channels"]:
        target, sampler = channel["target"], chosen["samplers"][channel["sampler"]]
        if "node" not in target:
            continue
        interpolation = sampler.get("interpolation", "LINEAR")
        times = document.array(sampler["input"])[:, 0]
        if len(times) == 0 or not np.isfinite(times).all() or (np.diff(times) <= 0).any():
            raise InputError(
                f"{document.path}: keyframes of its animation are not in order of time"
            )
        shape = (len(times), 3, -1) if interpolation == "CUBICSPLINE" else (len(times), -1)
        values = document.array(sampler["output"]).reshape(shape)
        found.append(Channel(target["node"], target["path"], interpolation, times, values))
    return found
