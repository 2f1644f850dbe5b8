"""The triangles of glTF meshes, with what moves them."""

from dataclasses import dataclass

import numpy as np

from sim.scene.check import checked_faces
from sim.scene.gltf.document import Document

TRIANGLES, STRIP, FAN = 4, 5, 6


@dataclass(frozen=True)
class Primitive:
    """Triangles of one node's mesh.

    Attributes
    ----------
    node : int
        Places it, unless a skin does.
    skin : int or None
    positions : (V, 3) float64
    faces : (T, 3) int32
    targets : (K, V, 3) float64
        Displacements of the morph targets.
    joints, weights : (V, J)
        Joints of the skin and their weights, whose sum is 1.
    """

    node: int
    skin: int | None
    positions: np.ndarray
    faces: np.ndarray
    targets: np.ndarray
    joints: np.ndarray
    weights: np.ndarray


def primitives(document: Document, node: int) -> list[Primitive]:
    """All triangles of a node's mesh; points and lines are left out."""
    place = document.gltf["nodes"][node]
    if "mesh" not in place:
        return []
    found = []
    for part in document.gltf["meshes"][place["mesh"]]["primitives"]:
        mode, attributes = part.get("mode", TRIANGLES), part["attributes"]
        if mode not in (TRIANGLES, STRIP, FAN) or "POSITION" not in attributes:
            continue
        accessor = document.gltf["accessors"][attributes["POSITION"]]
        if "bufferView" not in accessor:  # an extension may hold the positions
            for extension in part.get("extensions", []):
                document.refuse(extension)
        positions = document.array(attributes["POSITION"]).astype(np.float64)
        indices = np.arange(len(positions))
        if "indices" in part:
            indices = document.array(part["indices"])[:, 0]
        faces = _triangles(indices, mode)
        if not len(faces):
            continue
        targets = [
            _displacement(document, target, len(positions)) for target in part.get("targets", [])
        ]
        joints, weights = _influences(document, attributes, len(positions))
        found.append(
            Primitive(
                node,
                place.get("skin"),
                positions,
                checked_faces(document.path, faces, len(positions)),
                np.reshape(targets, (len(targets), len(positions), 3)),
                joints,
                weights,
            )
        )
    return found


def _triangles(indices: np.ndarray, mode: int) -> np.ndarray:
    count = len(indices)
    if mode == TRIANGLES:
        return indices[: count // 3 * 3].reshape(-1, 3)
    first = np.arange(max(count - 2, 0))
    if mode == FAN:
        return indices[np.stack([0 * first, first + 1, first + 2], axis=1)]
    odd = first % 2  # every second triangle of a strip is turned round
    return indices[np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)]


def _displacement(document: Document, target: dict, vertices: int) -> np.ndarray:
    if "POSITION" not in target:
        return np.zeros((vertices, 3))
    return document.array(target["POSITION"]).astype(np.float64)


def _influences(
    document: Document, attributes: dict[str, int], vertices: int
) -> tuple[np.ndarray, np.ndarray]:
    joints, weights = [np.zeros((vertices, 0), np.int64)], [np.zeros((vertices, 0))]
    number = 0
    while f"JOINTS_{number}" in attributes:
        joints.append(document.array(attributes[f"JOINTS_{number}"]))
        weights.append(document.array(attributes[f"WEIGHTS_{number}"]))
        number += 1
    joint, weight = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
    if number:
        nothing = weight.sum(axis=1) == 0  # goes with its first joint, or it would fall to 0
        weight[nothing, 0] = 1
        weight /= weight.sum(axis=1, keepdims=True)
    return joint, weight
