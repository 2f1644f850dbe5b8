"""Mesh files of one frame, read by trimesh."""

from pathlib import Path

import numpy as np
import trimesh
from trimesh.exchange.load import mesh_formats

from sim.errors import InputError
from sim.scene.check import checked_faces, reading
from sim.scene.scene import Scene

# glTF moves and has a reader of its own; the others name no file or hold no triangles
MESH_SUFFIXES = frozenset(f".{name}" for name in mesh_formats()) - {
    ".gltf",
    ".glb",
    ".stl_ascii",
    ".xyz",
}


def read_mesh(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) float64 and faces (T, 3) int32 of a file; polygons become triangles.

    Vertices keep the file's order and are not merged; trimesh drops those of an OBJ without a face.
    """
    with reading(path):
        loaded = trimesh.load_scene(str(path), process=False, skip_materials=True)
        meshes = [mesh for mesh in loaded.dump() if isinstance(mesh, trimesh.Trimesh)]
        if not meshes:
            raise InputError(f"{path}: has no triangles; a scene needs at least one")
        vertices = np.concatenate([np.asarray(mesh.vertices, np.float64) for mesh in meshes])
        starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes[:-1]])
        faces = np.concatenate([
            np.asarray(mesh.faces) + start for mesh, start in zip(meshes, starts, strict=True)
        ])
    return vertices, checked_faces(path, faces, len(vertices))


def load_mesh(path: Path) -> Scene:
    """A scene of one frame."""
    vertices, faces = read_mesh(path)
    return Scene(path.name, faces, 1, lambda frame: vertices.copy())
