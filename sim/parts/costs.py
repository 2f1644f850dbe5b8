"""What the parts of a scene cost a frame, whole and divided."""

from dataclasses import dataclass

import numpy as np

from hdl.config import Config
from sim.compiler.compile import compile_tree
from sim.compiler.image import Image
from sim.compiler.partial import partial
from sim.parts.part import Analysis, Kind, Part, part_scene
from sim.scene.scene import Scene
from sim.tree.build import POSES, build, spread
from sim.tree.rebuild import HOST_SECONDS

INSTANCE_WORDS = 5
"""That the host writes for an instance that moves: three rows of its matrix, two corners of its
box."""


@dataclass(frozen=True)
class Cost:
    """What is written and run in a frame.

    Attributes
    ----------
    words : float
        Memory words that the host writes, the mean over all frames but the first: a vertex that
        has moved is one, an instance that has INSTANCE_WORDS.
    instructions : int
        Of the program that updates all that ever moves. It is made once, and stays in memory.
    """

    words: float
    instructions: int


@dataclass(frozen=True)
class Rebuild:
    """What a new tree of a part takes.

    Attributes
    ----------
    milliseconds : float
        To build and compile it on the host, at `sim.tree.rebuild.HOST_SECONDS` a triangle.
    words : int
        Of its memory image, which are written: program, vertices, triangles, nodes.
    """

    milliseconds: float
    words: int


@dataclass(frozen=True)
class Costs:
    """Of a scene.

    Attributes
    ----------
    parts : list of Cost
        Of each part as if no other moved. Nodes above several parts are in the program of each.
    rebuilds : dict of int to Rebuild
        Of the parts that are unstructured.
    whole : Cost
        Of one tree over all triangles.
    divided : Cost
        Of a tree over static and deforming triangles and over the boxes of instances.
    """

    parts: list[Cost]
    rebuilds: dict[int, Rebuild]
    whole: Cost
    divided: Cost


def costs(scene: Scene, analysis: Analysis, config: Config) -> Costs:
    """Count words and instructions, by compiling what is counted.

    Parameters
    ----------
    scene : Scene
    analysis : Analysis
        Of the same scene.
    config : Config
        Of the machine: programs depend on its registers.

    Raises
    ------
    InputError
        The machine is too small for the scene.
    """
    parts, frames = analysis.parts, analysis.frames
    words, changed, moves = _written(scene, analysis)
    image, owner = _world(scene, analysis, config)
    leaf_owner = owner[image.order.triangles]
    leaf_moves = _triangles_move(scene, parts, moves)[image.order.triangles]

    def program(leaves: np.ndarray) -> int:
        return len(partial(image, leaves & leaf_moves).instructions)

    each = [
        Cost(count, 0 if part.kind is Kind.STATIC else program(leaf_owner == k))
        for k, (part, count) in enumerate(zip(parts, words, strict=True))
    ]
    rebuilds = {
        k: _rebuild(part_scene(scene, part), frames, config)
        for k, part in enumerate(parts)
        if part.kind is Kind.UNSTRUCTURED
    }
    whole = len(_compiled(scene, frames, config).instructions) if moves.any() else 0
    divided = Cost(sum(words), program(np.ones(len(leaf_owner), bool)))
    return Costs(each, rebuilds, Cost(changed, whole), divided)


def _written(scene: Scene, analysis: Analysis) -> tuple[list[float], float, np.ndarray]:
    """Words a frame of each part and of all vertices, and which vertices ever move (V,)."""
    parts, frames = analysis.parts, analysis.frames
    before = scene.pose(frames[0])
    owner = np.full(len(before), -1)
    for k, part in enumerate(parts):
        owner[part.vertices] = k
    structured = np.array([part.kind is Kind.STRUCTURED for part in parts])
    words, changed = np.zeros(len(parts)), 0
    moves = np.zeros(len(before), bool)
    for frame in frames[1:]:
        pose = scene.pose(frame)
        other = (pose != before).any(axis=1) & (owner >= 0)
        vertices = np.bincount(owner[other], minlength=len(parts))
        words += np.where(structured, INSTANCE_WORDS * (vertices > 0), vertices)
        changed += int(other.sum())
        moves |= other
        before = pose
    steps = max(len(frames) - 1, 1)
    return (words / steps).tolist(), changed / steps, moves


def _world(scene: Scene, analysis: Analysis, config: Config) -> tuple[Image, np.ndarray]:
    """The tree above all parts, and the part of each of its triangles.

    An instance's box is a leaf like a triangle: merged from its lowest and its highest corner.
    """
    parts, frames = analysis.parts, analysis.frames
    kept, owners = [], []
    instances: list[Part] = []
    count = len(scene.pose(frames[0]))
    for k, part in enumerate(parts):
        if part.kind is Kind.STRUCTURED:
            low = count + 2 * len(instances)
            kept.append(np.array([[low, low + 1, low + 1]]))
            instances.append(part)
        else:
            kept.append(scene.faces[part.faces])
        owners.append(np.full(len(kept[-1]), k))

    def pose(frame: int) -> np.ndarray:
        vertices = scene.pose(frame)
        boxes = [
            corner
            for part in instances
            for corner in (
                vertices[part.vertices].min(axis=0),
                vertices[part.vertices].max(axis=0),
            )
        ]
        return np.concatenate([vertices, np.reshape(boxes, (-1, 3))])

    faces = np.concatenate(kept).astype(np.int32)
    world = Scene(scene.name, faces, scene.frames, pose)
    return _compiled(world, frames, config), np.concatenate(owners)


def _triangles_move(scene: Scene, parts: list[Part], moves: np.ndarray) -> np.ndarray:
    """Whether each triangle of the tree of `_world` ever moves."""
    return np.concatenate([
        np.ones(1, bool)
        if part.kind is Kind.STRUCTURED
        else moves[scene.faces[part.faces]].any(axis=1)
        for part in parts
    ])


def _rebuild(scene: Scene, frames: range, config: Config) -> Rebuild:
    words = _compiled(scene, frames[:1], config).size
    return Rebuild(len(scene.faces) * HOST_SECONDS * 1e3, words)


def _compiled(scene: Scene, frames: range, config: Config) -> Image:
    poses = np.stack([scene.pose(frame) for frame in spread(frames, POSES)])
    return compile_tree(build(poses, scene.faces), scene.faces, config)
