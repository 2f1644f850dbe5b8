"""The affine map of a group of vertices from where it is at rest to where it is in a frame."""

from dataclasses import dataclass

import numpy as np

CONDITION = 256.0
"""Of a map that an instance may have: rays that it takes into the frame of the part lose 8 bits of
the 17 of F24 at most."""
ROUNDING = 1e-7
"""Of a group's extent: below it a direction is lost in what float64 leaves of squares."""


@dataclass(frozen=True)
class Fit:
    """Maps of groups in one frame.

    Attributes
    ----------
    maps : (G, 3, 4) float64
        From rest to the frame, each by least squares over the group's vertices.
    distances : (n,) float64
        Of each vertex from where the map of its group takes it.
    """

    maps: np.ndarray
    distances: np.ndarray


class Groups:
    """Groups of vertices at rest, whose maps are fitted frame by frame.

    Along a direction in which a group is no thicker than `thin` its vertices do not tell how it
    is stretched. There a map is completed as if it were rigid: a plate keeps its thickness and its
    front, a line turns the shortest way, and a point does not turn. So a map can be inverted
    wherever what is known of it can. All takes linear time.

    Parameters
    ----------
    rest : (n, 3) float64
        Vertices at rest, group by group.
    starts : (G,) int
        First vertex of each group, ascending from 0; none is empty.
    thin : float
        In units of the vertices: a root mean square.
    """

    def __init__(self, rest: np.ndarray, starts: np.ndarray, thin: float):
        self.starts = starts
        self.sizes = np.diff(starts, append=len(rest))
        self.group = np.repeat(np.arange(len(starts)), self.sizes)
        self._centre = self._means(rest)
        self._offsets = rest - self._centre[self.group]
        squares, axes = np.linalg.eigh(self._sums(_outer(self._offsets, self._offsets)))
        # The longest direction first, and right-handed.
        squares, axes = np.maximum(squares[:, ::-1], 0), axes[:, :, ::-1].copy()
        axes[:, :, 2] = np.cross(axes[:, :, 0], axes[:, :, 1])
        self.extents = np.sqrt(squares / self.sizes[:, np.newaxis])
        least = np.maximum(thin, ROUNDING * self.extents[:, :1])
        self.rank = (self.extents > least).sum(axis=1)
        known = np.arange(3) < self.rank[:, np.newaxis]
        self._axes = axes
        self._weights = np.where(known, 1 / np.where(known, squares, 1), 0)

    def fit(self, pose: np.ndarray) -> Fit:
        """Maps to a pose (n, 3) of the same vertices."""
        centre = self._means(pose)
        offsets = pose - centre[self.group]
        moments = self._sums(_outer(offsets, self._offsets))
        images = (moments @ self._axes) * self._weights[:, np.newaxis]
        linear = self._completed(images) @ self._axes.transpose(0, 2, 1)
        shift = centre - np.einsum("gij,gj->gi", linear, self._centre)
        expected = np.einsum("nij,nj->ni", linear[self.group], self._offsets)
        maps = np.concatenate([linear, shift[:, :, np.newaxis]], axis=2)
        return Fit(maps, np.linalg.norm(expected - offsets, axis=1))

    def largest(self, values: np.ndarray) -> np.ndarray:
        """The largest value (G,) of each group, of one value (n,) a vertex."""
        return np.maximum.reduceat(values, self.starts)

    def _sums(self, values: np.ndarray) -> np.ndarray:
        return np.add.reduceat(values, self.starts, axis=0)

    def _means(self, points: np.ndarray) -> np.ndarray:
        return self._sums(points) / self.sizes[:, np.newaxis]

    def _completed(self, images: np.ndarray) -> np.ndarray:
        """Images (G, 3, 3), in columns, of all axes; 0 of a line or plate that vanishes."""
        images = images.copy()
        point, line, plate = (self.rank == rank for rank in range(3))
        images[point] = self._axes[point]
        images[line] = _shortest_turn(self._axes[line], images[line, :, 0])
        normal = np.cross(images[plate, :, 0], images[plate, :, 1])
        images[plate, :, 2] = _unit(normal)
        return images


def invertible(maps: np.ndarray) -> np.ndarray:
    """Whether maps (..., 3, 4) have a condition of CONDITION at most: (...) bool."""
    stretch = np.linalg.svd(maps[..., :3], compute_uv=False)
    return (stretch[..., 2] > 0) & (stretch[..., 0] <= CONDITION * stretch[..., 2])


def applied(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Points (n, 3) under a map (3, 4)."""
    return points @ matrix[:, :3].T + matrix[:, 3]


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, :, np.newaxis] * b[:, np.newaxis]


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors of length 1; those that are 0 stay so."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors / np.where(length > 0, length, 1)


def _shortest_turn(axes: np.ndarray, images: np.ndarray) -> np.ndarray:
    """Axes (G, 3, 3), in columns, after the shortest turn of the first one towards `images` (G, 3).

    The first column is the image itself; all are 0 where that is 0. A turn from unit u to unit a
    is half a turn about u and then half a turn about u + a, or about the second axis if a is -u.
    """
    u, a = axes[:, :, 0], _unit(images)
    about = _unit(u + a)
    opposite = np.linalg.norm(u + a, axis=1) < 1e-8
    about[opposite] = axes[opposite, :, 1]
    half_turn = 2 * _outer(about, about) - np.eye(3)
    turned = half_turn @ (axes * np.array([1.0, -1.0, -1.0]))
    turned[:, :, 0] = images
    turned[~images.any(axis=1)] = 0
    return turned
