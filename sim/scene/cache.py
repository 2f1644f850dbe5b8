"""Vertex caches: `.npz` files that hold every frame's vertices."""

from pathlib import Path
from zipfile import is_zipfile

import numpy as np

from sim.errors import InputError
from sim.scene.check import checked_faces, reading
from sim.scene.scene import Scene

WRITTEN = "write it with np.savez(file, faces=..., vertices=...)"


def load_cache(path: Path) -> Scene:
    """Read `faces` (T, 3) and `vertices` (F, V, 3), or (V, 3) for one frame; other arrays are left.

    Write one with `np.savez(path, faces=faces, vertices=vertices)`.

    Raises
    ------
    InputError
        It is no such file, or its arrays are no scene.
    """
    with reading(path):
        if not is_zipfile(path):
            raise InputError(f"{path}: is no .npz file, or one cut short; {WRITTEN}")
        with np.load(path) as arrays:
            faces, vertices = _arrays(path, arrays)
    shape = vertices.shape
    if vertices.ndim == 2:
        vertices = vertices[np.newaxis]
    if vertices.ndim != 3 or vertices.shape[2] != 3 or vertices.dtype.kind not in "fiu":
        raise InputError(
            f"{path}: vertices must be numbers of shape (frames, vertices, 3) or (vertices, 3), "
            f"but are {vertices.dtype} of shape {shape}"
        )
    if len(vertices) == 0:
        raise InputError(f"{path}: vertices of shape {shape} hold no frame; at least one is needed")
    faces = checked_faces(path, faces, vertices.shape[1])
    return Scene(path.name, faces, len(vertices), lambda frame: vertices[frame].astype(np.float64))


def _arrays(path: Path, arrays: np.lib.npyio.NpzFile) -> tuple[np.ndarray, np.ndarray]:
    for name in ("faces", "vertices"):
        if name not in arrays:
            held = ", ".join(arrays) or "nothing"
            raise InputError(f"{path}: has no array '{name}' (it holds {held}); {WRITTEN}")
    return arrays["faces"], arrays["vertices"]
