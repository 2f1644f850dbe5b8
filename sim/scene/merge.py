"""Merging vertices that are one point of the surface."""

import numpy as np

from sim.scene.check import check_finite
from sim.scene.scene import Scene


def merge_vertices(scene: Scene) -> Scene:
    """The scene with one vertex for all that coincide in every frame.

    Files split a vertex where texture or normals have a seam; to a tree and to a ray it is one.
    0.0 equals -0.0. Vertices keep the order of their first occurrence, also those that no
    triangle uses. Every frame is posed once, and must be finite; none is stored.
    """
    first = coinciding(scene, range(scene.frames))
    kept, inverse = np.unique(first, return_inverse=True)
    if len(kept) == len(first):
        return scene
    faces = inverse.astype(np.int32)[scene.faces]
    return Scene(scene.name, faces, scene.frames, lambda frame: scene.pose(frame)[kept])


def coinciding(scene: Scene, frames: range) -> np.ndarray:
    """For each vertex the first one (V,) that it coincides with in all frames; often itself."""
    first = np.zeros(len(scene.pose(frames[0])), np.int64)
    for frame in frames:
        vertices = scene.pose(frame)
        check_finite(scene.name, frame, vertices)
        # Only vertices that leave the one they were equal to so far are compared anew: past the
        # first frame there are few, so later frames take linear time.
        apart = np.flatnonzero((vertices != vertices[first]).any(axis=1))
        if frame == frames[0]:
            apart = np.arange(len(vertices))
        first[apart] = apart[first_equal(first[apart], vertices[apart])]
    return first


def first_equal(group: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """For each row the first row of the same group (N,) and position (N, 3)."""
    if len(group) == 0:
        return group
    order = np.lexsort((*vertices.T, group))  # stable: a run of equals begins with its first
    group, vertices = group[order], vertices[order]
    begins = np.ones(len(order), bool)
    begins[1:] = (group[1:] != group[:-1]) | (vertices[1:] != vertices[:-1]).any(axis=1)
    first = np.empty_like(order)
    first[order] = order[begins][np.cumsum(begins) - 1]
    return first
