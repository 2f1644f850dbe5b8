"""The node hierarchy of a glTF file: where each node is."""

import numpy as np

REST = {"translation": (0, 0, 0), "rotation": (0, 0, 0, 1), "scale": (1, 1, 1)}


def placed_nodes(gltf: dict) -> list[tuple[int, int]]:
    """(node, parent) of every node of the file, parents first; the parent of a root is -1."""
    nodes = gltf["nodes"]
    children = [child for node in nodes for child in node.get("children", [])]
    waiting = [(node, -1) for node in sorted({*range(len(nodes))} - {*children})]
    placed = []
    if len(set(children)) == len(children):  # else the walk may have no end
        while waiting:
            node, parent = waiting.pop()
            placed.append((node, parent))
            waiting += [(child, node) for child in nodes[node].get("children", [])]
    if len(placed) != len(nodes):
        raise ValueError("a node is its own ancestor, or has two parents")
    return placed


def shown_nodes(gltf: dict) -> list[int]:
    """The nodes of the default scene, ascending; of the first one, or all, where there is none.

    The nodes must be trees, as `placed_nodes` checks.
    """
    if not gltf.get("scenes"):
        return list(range(len(gltf["nodes"])))
    waiting = list(gltf["scenes"][gltf.get("scene", 0)].get("nodes", []))
    shown = set()
    while waiting:
        node = waiting.pop()
        shown.add(node)
        waiting += gltf["nodes"][node].get("children", [])
    return sorted(shown)


def local_matrix(node: dict, moved: dict[str, np.ndarray]) -> np.ndarray:
    """Matrix (4, 4) of a node in its parent, acting on columns; `moved` are animated properties."""
    if "matrix" in node and not moved:
        return np.array(node["matrix"], np.float64).reshape(4, 4).T
    translation, rotation, scale = (
        np.array(moved.get(name, node.get(name, rest)), np.float64) for name, rest in REST.items()
    )
    x, y, z, w = rotation / np.linalg.norm(rotation)
    turn = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * scale
    matrix[:3, 3] = translation
    return matrix
