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

WORLD = -1
"""Number of the world's tree among those of parts."""


@dataclass(frozen=True)
class Grown:
    """Trees over points: vertices of the scene, then two corners of a box an instance.

    Attributes
    ----------
    trees : dict of Tree
        By the number of the part, or WORLD.
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
    """Trees of a normalised scene, by the number of their part: of objects, and what flies apart.

    The world's, under WORLD, is over the triangles of parts that are still or bend, and over the
    boxes of all others. All but those of objects are built over some poses.
    """
    poses = np.stack([scene.pose(frame) for frame in spread(analysis.frames, POSES)])
    rest, everything = scene.pose(analysis.frames[0]), poses.reshape(-1, 3)
    trees = {}
    for k, part in enumerate(analysis.parts):
        faces = scene.faces[part.faces]
        if part.kind == Kind.STRUCTURED and part.shares is None:
            trees[k] = build(rest, faces, builder, around=everything)
        elif part.kind == Kind.UNSTRUCTURED:
            trees[k] = build(poses, faces, builder, around=poses)
    boxed = [poses[:, part.vertices] for part in analysis.parts if _is_boxed(part)]
    boxes = [np.stack([of.min(axis=1), of.max(axis=1)], axis=1) for of in boxed]
    points = np.concatenate([poses, *boxes], axis=1)
    trees[WORLD] = build(points, _world_faces(scene, analysis), builder)
    return trees


def _is_boxed(part: Part) -> bool:
    """The world's tree has its box."""
    return part.kind in (Kind.STRUCTURED, Kind.UNSTRUCTURED)


def _world_faces(scene: Scene, analysis: Analysis) -> np.ndarray:
    """What the world's tree is over: triangles, then two corners of a box, one of them twice.

    A tree has two leaves: beside the only instance there is a point of its box, which no ray hits.
    """
    own = [scene.faces[part.faces] for part in analysis.parts if not _is_boxed(part)]
    count = sum(_is_boxed(part) for part in analysis.parts)
    first = len(scene.pose(analysis.frames[0]))
    corners = first + 2 * np.arange(count)[:, np.newaxis] + (0, 1, 1)
    alone = not own and count == 1
    return np.concatenate([*own, corners, np.full((int(alone), 3), first)]).astype(np.int32)


def join(scene: Scene, analysis: Analysis, trees: Mapping[int, Tree]) -> Grown:
    """The world of all parts, given its tree and those of parts."""
    parts = analysis.parts
    rest = scene.pose(analysis.frames[0])
    shapes = [k for k in trees if k != WORLD and parts[k].kind == Kind.STRUCTURED]
    frames = {k: frame_of(rest[parts[k].vertices]) for k in shapes}

    own = [part.faces for part in parts if not _is_boxed(part)]
    triangles = [np.concatenate([*own, np.zeros(0, np.int32)])]
    corners = [scene.faces[triangles[0]]]
    leaves = len(triangles[0])
    items: list[tuple[Tree | None, int]] = [(None, leaf) for leaf in range(leaves)]
    instances, placed = [], []
    for k, part in enumerate(parts):
        if part.kind == Kind.STRUCTURED:
            of = k if part.shares is None else part.shares
            corner = len(rest) + 2 * len(placed)
            corners.append(np.array([[corner, corner + 1, corner + 1]]))
            triangles.append(np.array([-1]))
            instances.append((leaves, shapes.index(of)))
            placed.append((part, frames[of]))
            items.append((None, leaves))
        elif part.kind == Kind.UNSTRUCTURED:
            corners.append(scene.faces[part.faces])
            triangles.append(part.faces)
            items.append((trees[k], leaves))
        else:
            continue
        leaves += len(corners[-1])
    if len(items) == 1 and placed:
        corners.append(np.full((1, 3), len(rest)))
        triangles.append(np.array([-1]))
        items.append((None, leaves))
    world = graft(trees[WORLD], items) if len(items) > 1 else items[0][0] or trees[WORLD]
    return Grown(
        trees,
        Branch(world, np.concatenate(corners).astype(np.int32)),
        [Branch(trees[k], scene.faces[parts[k].faces]) for k in shapes],
        np.array(instances, np.int32).reshape(-1, 2),
        [part for part, _ in placed],
        [frame for _, frame in placed],
        np.concatenate([*triangles, *(parts[k].faces for k in shapes)]).astype(np.int32),
    )
