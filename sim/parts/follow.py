"""Affine maps of groups of vertices over all frames, and how far they hold."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.parts.motion import Groups, invertible


@dataclass(frozen=True)
class Followed:
    """What became of groups in F frames.

    Attributes
    ----------
    maps : (G, F, 3, 4) float64
        From rest.
    residual : (G,) float64
        Largest distance of a vertex from its map.
    inverts : (G,) bool
        Whether all maps can be inverted.
    worst : (G,) int
        Frame, from 0, of a map that cannot, or else of the largest distance.
    """

    maps: np.ndarray
    residual: np.ndarray
    inverts: np.ndarray
    worst: np.ndarray

    def holds(self, error: float) -> np.ndarray:
        """Groups (G,) that are where their maps take them, to within `error`."""
        return self.inverts & (self.residual <= error)


def follow(
    pose: Callable[[int], np.ndarray],
    frames: range,
    vertices: np.ndarray,
    rest: np.ndarray,
    starts: np.ndarray,
    thin: float,
) -> Followed:
    """Fit groups in all frames: each is posed once, and none is kept.

    Parameters
    ----------
    pose : callable, frame -> (V, 3) float64
    frames : range
    vertices : (n,) int
        Group by group.
    rest : (n, 3) float64
        Where the maps begin: the first pose, or another part's.
    starts, thin
        Of sim.parts.motion.Groups.
    """
    groups = Groups(rest, starts, thin)
    maps = np.empty((len(starts), len(frames), 3, 4))
    residuals = np.empty((len(starts), len(frames)))
    inverts = np.empty(residuals.shape, bool)
    for k, frame in enumerate(frames):
        fit = groups.fit(pose(frame)[vertices])
        maps[:, k] = fit.maps
        residuals[:, k] = groups.largest(fit.distances)
        inverts[:, k] = invertible(fit.maps)
    worst = np.where(inverts, residuals, np.inf).argmax(axis=1)
    return Followed(maps, residuals.max(axis=1), np.logical_and.reduce(inverts, axis=1), worst)
