"""The shape of a B-KD tree: what stays constant while the bounds move."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Tree:
    """A binary tree with one triangle a leaf. Bounds are not part of it: every frame has its own.

    Nodes are inner nodes, parents before children, the root first. A mesh of one triangle
    has one node whose children are both that triangle.

    Attributes
    ----------
    children : (N, 2) int32
        Left and right child: a node if >= 0, else ~child is a triangle. N = max(T - 1, 1).
    axis : (N,) uint8
        The axis on which a node bounds its children: 0, 1 or 2.
    """

    children: np.ndarray
    axis: np.ndarray
