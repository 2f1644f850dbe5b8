"""Which structured parts are one geometry in several places."""

import numpy as np

from sim.parts.motion import Groups, invertible
from sim.parts.part import Part, local_faces


def sharing(
    parts: list[Part], chosen: list[int], faces: np.ndarray, rest: np.ndarray, error: float
) -> dict[int, int]:
    """For parts among those chosen: the first one before it with the same geometry.

    The same triangles, vertex for vertex, and an affine map from rest to rest that misses no
    vertex by more than `error`.

    Parameters
    ----------
    parts : list of Part
    chosen : list of int
        Ascending.
    faces : (T, 3) int32
        Of the scene.
    rest : (V, 3) float64
    error : float
    """
    found: dict[int, int] = {}
    firsts: dict[tuple[int, bytes], list[int]] = {}
    for index in chosen:
        part = parts[index]
        key = (len(part.vertices), local_faces(part, faces).tobytes())
        before = firsts.setdefault(key, [])
        for first in before:
            if _same(rest[parts[first].vertices], rest[part.vertices], error):
                found[index] = first
                break
        else:
            before.append(index)
    return found


def _same(points: np.ndarray, others: np.ndarray, error: float) -> bool:
    fit = Groups(points, np.zeros(1, np.int64), error).fit(others)
    if not invertible(fit.maps).all():
        return False
    return bool(fit.distances.max() <= error)
