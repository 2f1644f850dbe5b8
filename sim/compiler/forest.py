"""Two levels of trees to one memory image: a tree of the world, and those of its objects."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdl.config import Config
from sim.compiler.compile import check_pointers, place
from sim.compiler.image import Image, Instances
from sim.compiler.order import Order, least_boxes
from sim.compiler.partial import partial
from sim.tree.tree import Tree

MOST = 5
"""Instructions of a leaf: a merge of its corners, one of a node, and three loads at most; or of a
box that is still, two loads and a jump past its nodes."""


@dataclass(frozen=True)
class Branch:
    """A tree, and the points that its leaves are merged from.

    Attributes
    ----------
    tree : Tree
    corners : (T, 3) int32
        Indices of points.
    """

    tree: Tree
    corners: np.ndarray


def compile_forest(
    world: Branch, objects: Sequence[Branch], instances: np.ndarray, config: Config
) -> Image:
    """Image of a world in which some leaves are instances of objects, without a program.

    The trees of objects are still. World first, objects after
    it, in all tables: what holds for the image of the world alone holds here. (Two levels as in
    Wald, Benthin, Slusallek, "Distributed Interactive Ray Tracing of Dynamic Scenes", 2003.)

    Parameters
    ----------
    world : Branch
        An instance is a leaf of which the lowest and the highest corner of a box are the corners.
    objects : sequence of Branch
    instances : (I, 2) int
        For each instance its leaf of the world's tree, and its object.
    config : Config

    Raises
    ------
    InputError
        The configuration is too small for the scene.
    """
    images = [_placed(branch, config) for branch in (world, *objects)]
    nodes = _offsets([image.nodes for image in images])
    leaves = _offsets([len(image.corners) for image in images])
    vertices = _offsets([len(image.vertices) for image in images])
    triangles = _offsets([len(branch.corners) for branch in (world, *objects)])
    children = [
        np.where(c >= 0, c + node, c - leaf)
        for c, node, leaf in zip([i.order.children for i in images], nodes, leaves, strict=False)
    ]
    first = images[0]
    check_pointers(int(leaves[-1]), config)
    order = Order(
        np.concatenate(children).astype(np.int32),
        np.concatenate([image.order.axis for image in images]),
        np.concatenate([
            image.order.triangles + begin for image, begin in zip(images, triangles, strict=False)
        ]).astype(np.int32),
        first.order.boxes,
    )
    leaf_of = np.empty(len(world.corners), np.int32)
    leaf_of[first.order.triangles] = np.arange(len(first.corners))
    of = 1 + instances[:, 1]
    return Image(
        config,
        order,
        first.instructions,
        np.concatenate([image.vertices for image in images]),
        np.concatenate([
            image.corners + begin for image, begin in zip(images, vertices, strict=False)
        ]).astype(np.int32),
        first.nodes,
        Instances(
            leaf_of[instances[:, 0]],
            (nodes[of + 1] - 1).astype(np.int32),
            np.stack([leaves[of], leaves[of + 1]], axis=1).astype(np.int32),
        ),
    )


def moving_only(image: Image, moves: np.ndarray, *, regrown: bool) -> Image:
    """The image with a program of what can move: leaves (L,) that do, and the nodes above them.

    Bounds of all others are written once. Nothing moves, and there is no program. If `regrown`,
    there is room for the longest program of any other trees over these leaves.

    Raises
    ------
    InputError
        The boxes of what is still do not fit, or there are too few box registers.
    """
    part = partial(image, moves)
    room = MOST * (int(part.merged.sum()) + len(part.spans)) if regrown else 0
    return replace(
        image,
        order=replace(image.order, boxes=part.boxes),
        instructions=part.instructions,
        still=part.spans,
        room=room,
    )


def _placed(branch: Branch, config: Config) -> Image:
    """A tree in the order for a program of a part of it, which may need fewer boxes than all."""
    boxes = max(config.box_registers, least_boxes(branch.tree))
    return place(branch.tree, branch.corners, config, boxes)


def _offsets(counts: Sequence[int]) -> np.ndarray:
    """Where each begins that follow each other, and the end of the last."""
    return np.cumsum([0, *counts])
