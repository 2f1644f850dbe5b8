"""`explosion`: a shell that bursts into pieces of very different speeds."""

import numpy as np

from sim.scene.builtin.rotate import rotations
from sim.scene.builtin.shapes import SMALLEST_SPHERE, check_size, sphere
from sim.scene.scene import Scene

TRIANGLES = 12  # of a piece, about, up to so many pieces:
MOST = 200
FASTEST = 3.0  # radii a period
DECADES = 6
"""The slowest piece is so many powers of ten slower."""


def explosion(spec: str, triangles: int, frames: int) -> Scene:
    """A unit sphere that breaks into pieces, each of which flies outwards and tumbles.

    The logarithms of the speeds are spread evenly over six decades, in no order, so that the
    pieces are soon mixed: some have left while others have not begun to show a crack. Unlike in
    `burst`, where all triangles are single and about as fast, the triangles of a piece share
    their vertices and stay together: what a tree over them is worth depends on whether its nodes
    keep to pieces. Frame 0 is the whole sphere.
    """
    check_size(spec, triangles, SMALLEST_SPHERE)
    points, faces = sphere(triangles)
    rng = np.random.default_rng(2006)
    count = min(max(2, triangles // TRIANGLES), MOST)
    seeds, axes = directions = rng.normal(size=(2, count, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    speeds = FASTEST * 10 ** (-DECADES * rng.permutation(count) / (count - 1))

    # A piece is what is nearest to its seed; pieces share no vertex.
    piece = np.argmax(points[faces].mean(axis=1) @ seeds.T, axis=1)
    owned, corners = np.unique(piece[:, np.newaxis] * len(points) + faces, return_inverse=True)
    owner, rest = owned // len(points), points[owned % len(points)]
    size = np.bincount(owner, minlength=count)
    sums = [np.bincount(owner, rest[:, k], minlength=count) for k in range(3)]
    centres = np.stack(sums, axis=1) / np.maximum(size, 1)[:, np.newaxis]
    offsets = rest - centres[owner]

    def pose(frame: int) -> np.ndarray:
        gone = speeds * frame / frames
        turned = np.einsum("vij,vj->vi", rotations(axes, 2 * gone)[owner], offsets)
        return (centres + gone[:, np.newaxis] * seeds)[owner] + turned

    return Scene(spec, corners.reshape(-1, 3).astype(np.int32), frames, pose)
