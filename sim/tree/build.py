"""Building a B-KD tree over a mesh at rest."""

import numpy as np

from sim.tree.grow import OBJECT_MEDIAN, SAH, SPATIAL_MEDIAN, grow
from sim.tree.tree import Tree

BUILDERS = {"sah": SAH, "spatial-median": SPATIAL_MEDIAN, "object-median": OBJECT_MEDIAN}


def build(vertices: np.ndarray, faces: np.ndarray, builder: str = "sah") -> Tree:
    """Build a tree of at most `sim.tree.grow.MAX_DEPTH` levels over one pose of a mesh.

    The lecture's construction: triangles are sorted by centre of mass along all three
    dimensions, every position of every list is a partition, and the tree takes the one of least
    SAH cost (Wald 2007 calls it the full sweep). It goes beyond the lecture in two ways, both for
    `sim.tree.cost.cost`: the SAH cost counts that a node bounds its children on one axis only
    (`sim.tree.grow.REGION_WEIGHT`), and that axis is the best one, not always the sorted one.

    Parameters
    ----------
    vertices : (V, 3) float64
        Any unit. Duplicates, degenerate and coincident triangles are welcome.
    faces : (T, 3) int
        Vertex indices, T >= 1.
    builder : str
        A key of BUILDERS: "sah"; "spatial-median" splits the longest axis of the centres' bounds
        in the middle; "object-median" leaves half of the triangles on each side of it.

    Returns
    -------
    Tree
        Nodes in pre-order. The same input gives the same tree, at any power-of-two scale.

    Raises
    ------
    ValueError
        No such builder, no triangles, a vertex index out of range, a vertex that is not finite.
    """
    vertices = np.asarray(vertices, np.float64)
    faces = np.asarray(faces)
    _check(vertices, faces, builder)
    if len(faces) == 1:
        return Tree(np.full((1, 2), ~0, np.int32), np.zeros(1, np.uint8))

    # Into [-1, 1] by an exact scale, so that areas neither overflow nor vanish.
    _, exponent = np.frexp(np.abs(vertices[faces]).max())
    corners = np.ldexp(vertices[faces], -exponent)
    centroids = corners.mean(axis=1)
    boxes = np.concatenate([corners.min(axis=1), corners.max(axis=1)], axis=1)
    orders = np.argsort(centroids.T, axis=1, kind="stable").astype(np.int32)
    return Tree(*grow(boxes, centroids, orders, BUILDERS[builder]))


def _check(vertices: np.ndarray, faces: np.ndarray, builder: str):
    if builder not in BUILDERS:
        raise ValueError(f"no builder {builder!r}: take one of {', '.join(BUILDERS)}")
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise ValueError(f"vertices have shape {vertices.shape}, not (V, 3)")
    if faces.ndim != 2 or faces.shape[1] != 3 or not len(faces):
        raise ValueError(f"faces have shape {faces.shape}, not (T, 3) with T >= 1")
    bad = np.argwhere((faces < 0) | (faces >= len(vertices)))
    if len(bad):
        triangle, corner = bad[0]
        raise ValueError(
            f"triangle {triangle} names vertex {faces[triangle, corner]} of {len(vertices)}"
        )
    bad = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(bad):
        raise ValueError(f"vertex {bad[0]} is not finite: {vertices[bad[0]]}")
