"""Trees of a scene of parts: one of the world over those of its parts, and one an object."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sim.compiler.forest import Branch
from sim.divide.placement import Frame, frame_of
from sim.parts.part import Analysis, Kind, Part
from sim.prepare import POSES, spread
from sim.scene.scene import Scene
from sim.tree.build import build
from sim.tree.graft import graft
from sim.tree.tree import Tree


@dataclass(frozen=True)
class Grown:
    """Trees over points: vertices of the scene, then two corners of a box an instance.

    Attributes
    ----------
    trees : dict of Tree
        For each part by its number, but for those that share the geometry of another.
    world : Branch
    objects : list of Branch
        With the vertices of the part that has the geometry.
    instances : (I, 2) int
        For each its leaf of the world's tree, and its object.
    parts : list of Part
        The part that each instance is.
    frames : list of Frame
        Of the object of each instance.
    triangles : (L,) int32
        Of each leaf, the world's and then those of objects: a triangle of the scene, or -1.
    """

    trees: Mapping[int, Tree]
    world: Branch
    objects: list[Branch]
    instances: np.ndarray
    parts: list[Part]
    frames: list[Frame]
    triangles: np.ndarray


def trees_of(scene: Scene, analysis: Analysis, builder: str) -> dict[int, Tree]:
    """A tree for each part of a normalised scene that has a geometry of its own.

    Those in the world are built over some of its poses.
    """
    poses = np.stack([scene.pose(frame) for frame in spread(analysis.frames, POSES)])
    rest = scene.pose(analysis.frames[0])
    return {
        k: build(
            rest if part.kind == Kind.STRUCTURED else poses,
            scene.faces[part.faces],
            builder,
            around=poses.reshape(-1, 3) if part.kind == Kind.STRUCTURED else poses,
        )
        for k, part in enumerate(analysis.parts)
        if part.shares is None
    }


def join(scene: Scene, analysis: Analysis, trees: Mapping[int, Tree]) -> Grown:
    """The world of all parts, given the trees of those that have one."""
    parts = analysis.parts
    rest = scene.pose(analysis.frames[0])
    shapes = [k for k in trees if parts[k].kind == Kind.STRUCTURED]
    frames = {k: frame_of(rest[parts[k].vertices]) for k in shapes}

    items: list[tuple[Tree | None, int]] = []
    corners, triangles, instances, placed = [], [], [], []
    leaves = 0
    for k, part in enumerate(parts):
        if part.kind == Kind.STRUCTURED:
            of = k if part.shares is None else part.shares
            corner = len(rest) + 2 * len(placed)
            corners.append([[corner, corner + 1, corner + 1]])
            triangles.append([-1])
            instances.append((leaves, shapes.index(of)))
            placed.append((part, frames[of]))
            items.append((None, leaves))
        else:
            corners.append(scene.faces[part.faces])
            triangles.append(part.faces)
            items.append((trees[k], leaves))
        leaves += len(corners[-1])
    if len(items) == 1 and placed:
        # A tree has two leaves: beside the only instance a point of its box, which no ray hits.
        corners.append([[len(rest)] * 3])
        triangles.append([-1])
        items.append((None, leaves))
    world = items[0][0] if len(items) == 1 else graft(_top(scene, analysis, len(items)), items)
    assert world is not None
    return Grown(
        trees,
        Branch(world, np.concatenate(corners).astype(np.int32)),
        [Branch(trees[k], scene.faces[parts[k].faces]) for k in shapes],
        np.array(instances, np.int32).reshape(-1, 2),
        [part for part, _ in placed],
        [frame for _, frame in placed],
        np.concatenate([*triangles, *(parts[k].faces for k in shapes)]).astype(np.int32),
    )


def _top(scene: Scene, analysis: Analysis, items: int) -> Tree:
    """A tree over the boxes of parts, and of the first one again if there are more items."""
    poses = np.stack([scene.pose(frame) for frame in spread(analysis.frames, POSES)])
    boxes = [
        np.stack([used.min(axis=1), used.max(axis=1)], axis=1)
        for used in (poses[:, part.vertices] for part in analysis.parts)
    ]
    boxes += boxes[:1] * (items - len(boxes))
    first = 2 * np.arange(items)
    return build(np.concatenate(boxes, axis=1), np.stack([first, first + 1, first + 1], axis=1))
