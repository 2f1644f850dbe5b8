"""Numbered mesh files: one file a frame, all of one topology."""

import glob
import re
from pathlib import Path

import numpy as np

from sim.errors import InputError
from sim.scene.meshfile import MESH_SUFFIXES, read_mesh
from sim.scene.scene import Scene


def is_sequence(spec: str) -> bool:
    """Whether `spec` is a folder or a pattern such as `walk_*.obj`."""
    path = Path(spec)
    return path.is_dir() or (glob.has_magic(spec) and not path.exists())


def load_sequence(spec: str) -> Scene:
    """The files of a folder or pattern as frames, in the order of the numbers in their names."""
    paths = numbered_files(spec)
    first, faces = read_mesh(paths[0])
    frames = [first]
    for path in paths[1:]:
        vertices, other = read_mesh(path)
        difference = topology_difference(faces, len(first), other, len(vertices))
        if difference:
            raise InputError(
                f"{path}: {difference.format(paths[0].name)}; "
                "all frames of a sequence need the same triangles"
            )
        frames.append(vertices)
    return Scene(Path(spec).name, faces, len(frames), lambda frame: frames[frame].copy())


def numbered_files(spec: str) -> list[Path]:
    """The files that `spec` stands for. They may differ in their numbers only."""
    folder = Path(spec).is_dir()
    found = Path(spec).iterdir() if folder else map(Path, glob.glob(spec))
    paths = [path for path in found if path.is_file() and path.suffix.lower() in MESH_SUFFIXES]
    if not paths:
        place = "the folder holds" if folder else "the pattern matches"
        suffixes = ", ".join(sorted(MESH_SUFFIXES))
        raise InputError(f"{spec}: {place} no numbered mesh file ({suffixes})")
    patterns = sorted({re.sub(r"\d+", "#", path.name) for path in paths})
    if len(patterns) > 1:
        raise InputError(
            f"{spec}: holds more than one sequence ({', '.join(patterns)}); "
            f"choose one with a quoted pattern such as '{patterns[0].replace('#', '*')}'"
        )
    return sorted(paths, key=lambda path: ([int(n) for n in re.findall(r"\d+", str(path))], path))


def topology_difference(
    faces: np.ndarray, vertices: int, other_faces: np.ndarray, other_vertices: int
) -> str | None:
    """How a frame's mesh differs from the first one's, which the text calls `{}`."""
    if len(other_faces) != len(faces):
        return f"has {len(other_faces)} triangles, but {{}} has {len(faces)}"
    if other_vertices != vertices:
        return f"has {other_vertices} vertices, but {{}} has {vertices}"
    differs = (other_faces != faces).any(axis=1)
    if not differs.any():
        return None
    triangle = int(np.argmax(differs))
    return (
        f"triangle {triangle} joins vertices {tuple(other_faces[triangle].tolist())}, "
        f"but {tuple(faces[triangle].tolist())} in {{}}"
    )
