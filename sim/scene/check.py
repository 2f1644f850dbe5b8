"""Checks that every mesh passes before it is called a scene."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from sim.errors import InputError


@contextmanager
def reading(name: object) -> Iterator[None]:
    """Turn whatever a file library raises into one `InputError` line that names the file.

    Warnings of the library are dropped: what matters is either an error or checked afterwards.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise InputError(f"{name}: cannot be read, damaged or cut short? ({reason})") from error


def checked_faces(name: object, faces: np.ndarray, vertices: int) -> np.ndarray:
    """Faces as (T, 3) int32, T >= 1, every index in 0..vertices-1.

    `name` begins the error line: the file, and where it helps the mesh inside the file.
    """
    faces = np.asarray(faces)
    if faces.size == 0:
        raise InputError(f"{name}: has no triangles; a scene needs at least one")
    if faces.ndim != 2 or faces.shape[1] != 3 or faces.dtype.kind not in "iu":
        raise InputError(
            f"{name}: faces must be integers of shape (triangles, 3), "
            f"but are {faces.dtype} of shape {faces.shape}"
        )
    wrong = (faces < 0) | (faces >= vertices)
    if wrong.any():
        triangle, corner = np.argwhere(wrong)[0]
        raise InputError(
            f"{name}: triangle {triangle} uses vertex {faces[triangle, corner]}, "
            f"but there are {vertices} vertices, counted from 0"
        )
    return np.ascontiguousarray(faces, np.int32)


def check_finite(name: object, frame: int, vertices: np.ndarray) -> None:
    """Raise the error that names frame and vertex unless all of `vertices` (V, 3) are finite."""
    finite = np.isfinite(vertices)
    if not finite.all():
        vertex = int(np.argmin(finite.all(axis=1)))
        kind = "NaN" if np.isnan(vertices[vertex]).any() else "infinite"
        values = ", ".join(str(float(x)) for x in vertices[vertex])
        raise InputError(f"{name}: frame {frame}, vertex {vertex} is {kind} ({values})")
