"""Scenes from glTF 2.0 files: node transforms, skins and morph targets, sampled in time."""

from collections import defaultdict
from pathlib import Path

import numpy as np

from sim.errors import InputError
from sim.scene.check import reading
from sim.scene.gltf.animation import Channel, channels
from sim.scene.gltf.document import Document
from sim.scene.gltf.nodes import local_matrix, placed_nodes, shown_nodes
from sim.scene.gltf.primitives import Primitive, primitives
from sim.scene.scene import Scene
from sim.scene.skin import skin

MOST_FRAMES = 1_000_000  # more are a wrong time in the file or a wrong fps


def load_gltf(path: Path, fps: float, animation: str | None) -> Scene:
    """The triangles of a file's default scene; frame k is the animation at k / fps seconds.

    Parameters
    ----------
    path : Path
        .gltf or .glb.
    fps : float
        Frames a second; the animation's last moment gets a frame if it falls on one.
    animation : str, optional
        Name or number; the first one if not given.

    Raises
    ------
    InputError
    """
    if not 0 < fps < 1e6:
        raise InputError(f"{path}: fps is {fps}; give frames a second, above 0")
    with reading(path):
        document = Document(path)
        moves = channels(document, animation)
        placed = placed_nodes(document.gltf)
        parts = [part for node in shown_nodes(document.gltf) for part in primitives(document, node)]
        if not parts:
            raise InputError(f"{path}: has no triangles; a scene needs at least one")
        poser = _Poser(document, moves, parts, placed)
        poser.pose(0.0)  # fails here, if at all
        duration = max((float(channel.times[-1]) for channel in moves), default=0.0)
        frames = int(duration * fps * (1 + 1e-6) + 1e-6) + 1  # times are float32
        if frames > MOST_FRAMES:
            raise InputError(
                f"{path}: {duration:g} seconds at {fps:g} frames a second are {frames:g} frames; "
                f"{MOST_FRAMES} is the most, so choose a lower fps"
            )
    starts = np.cumsum([0] + [len(part.positions) for part in parts[:-1]])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return Scene(
        path.name,
        np.concatenate(faces).astype(np.int32),
        frames,
        lambda frame: poser.pose(frame / fps),
    )


class _Poser:
    """Evaluates the vertices of all parts at a time."""

    def __init__(
        self,
        document: Document,
        moves: list[Channel],
        parts: list[Primitive],
        placed: list[tuple[int, int]],
    ):
        self.gltf = document.gltf
        self.moves = moves
        self.parts = parts
        self.placed = placed
        self.inverses = [
            document.array(entry["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)
            if "inverseBindMatrices" in entry
            else np.tile(np.eye(4), (len(entry["joints"]), 1, 1))
            for entry in self.gltf["skins"]
        ]

    def pose(self, time: float) -> np.ndarray:
        """Vertices (V, 3) of all parts."""
        with np.errstate(all="ignore"):  # what a damaged file makes NaN is reported by vertex
            return self._pose(time)

    def _pose(self, time: float) -> np.ndarray:
        moved: dict[int, dict[str, np.ndarray]] = defaultdict(dict)
        for channel in self.moves:
            moved[channel.node][channel.path] = channel.at(time)
        world = np.empty((len(self.gltf["nodes"]), 4, 4))
        for node, parent in self.placed:
            animated = {k: v for k, v in moved[node].items() if k != "weights"}
            local = local_matrix(self.gltf["nodes"][node], animated)
            world[node] = local if parent < 0 else world[parent] @ local
        return np.concatenate([self._part(part, world, moved[part.node]) for part in self.parts])

    def _part(self, part: Primitive, world: np.ndarray, moved: dict) -> np.ndarray:
        vertices = part.positions
        if len(part.targets):
            node = self.gltf["nodes"][part.node]
            rest = node.get("weights", self.gltf["meshes"][node["mesh"]].get("weights", []))
            weights = np.zeros(len(part.targets))
            weights[: len(rest)] = rest
            weights = moved.get("weights", weights)
            vertices = vertices + np.tensordot(weights, part.targets, axes=1)
        if part.skin is not None and part.joints.shape[1]:
            joints = self.gltf["skins"][part.skin]["joints"]
            # Of the node's own transform nothing is left: the joints have their place in the world.
            matrices = world[joints] @ self.inverses[part.skin]
            return skin(vertices, part.joints, part.weights, matrices)
        matrix = world[part.node]
        return vertices @ matrix[:3, :3].T + matrix[:3, 3]
