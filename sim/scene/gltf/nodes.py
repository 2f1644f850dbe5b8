"""The node hierarchy of a glTF file: where each node is."""

import numpy as np
import pygltflib

REST = {"translation": (0, 0, 0), "rotation": (0, 0, 0, 1), "scale": (1, 1, 1)}


def placed_nodes(gltf: pygltflib.GLTF2) -> list[tuple[int, int]]:
    """(node, parent) of every node of the file, parents first; the parent of a root is -1."""
    children = {child for node in gltf.nodes for child in node.children or []}
    waiting = [(node, -1) for node in range(len(gltf.nodes)) if node not in children]
    placed = []
    while waiting:
        node, parent = waiting.pop()
        placed.append((node, parent))
        waiting += [(child, node) for child in gltf.nodes[node].children or []]
    if len(placed) != len(gltf.nodes):
        raise ValueError("a node is its own ancestor, or has two parents")
    return placed


def shown_nodes(gltf: pygltflib.GLTF2) -> list[int]:
    """The nodes of the default scene, ascending; of the first one, or all, where there is none."""
    if not gltf.scenes:
        return list(range(len(gltf.nodes)))
    waiting = list(gltf.scenes[gltf.scene or 0].nodes or [])
    shown = set()
    while waiting:
        node = waiting.pop()
        shown.add(node)
        waiting += gltf.nodes[node].children or []
    return sorted(shown)


def local_matrix(node: pygltflib.Node, moved: dict[str, np.ndarray]) -> np.ndarray:
    """Matrix (4, 4) of a node in its parent, acting on columns; `moved` are animated properties."""
    if node.matrix is not None and not moved:
        return np.array(node.matrix, np.float64).reshape(4, 4).T
    translation, rotation, scale = (
        np.array(moved.get(name, getattr(node, name) or rest), np.float64)
        for name, rest in REST.items()
    )
    x, y, z, w = rotation
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * scale
    matrix[:3, 3] = translation
    return matrix
