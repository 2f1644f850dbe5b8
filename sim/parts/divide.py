"""Pieces that move as one in all frames, found in a few of them."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim.parts.common import LEAST, Bundle, common_motion
from sim.parts.follow import follow
from sim.tree.build import spread

SAMPLES = 8
"""Frames after the first one in which common motion is looked for."""
MORE = 8
"""Frames at most that are added to them at a time, where motion turns out not to be common."""


@dataclass(frozen=True)
class Moving:
    """Pieces that move, their vertices one piece after the other.

    Attributes
    ----------
    vertices : (n,) int
        Of the scene.
    starts : (K,) int
        First vertex of each piece.
    sizes : (K,) int
        Distinct vertices of each piece.
    """

    vertices: np.ndarray
    starts: np.ndarray
    sizes: np.ndarray

    @property
    def piece(self) -> np.ndarray:
        """Of each vertex (n,)."""
        counts = np.diff(self.starts, append=len(self.vertices))
        return np.repeat(np.arange(len(counts)), counts)


def samples_of(frames: range) -> list[int]:
    """Frames in which common motion is looked for: not the first, which is rest."""
    return spread(frames, SAMPLES + 1)[1:]


def divide(
    pose: Callable[[int], np.ndarray], frames: range, moving: Moving, error: float
) -> np.ndarray:
    """Group (K,) of each piece that moves affinely, with others or alone; -1 for those that do not.

    Groups are found in a few frames and then held to all; those that fail are looked at again
    with the frames in which they did.
    """
    group = np.full(len(moving.starts), -1)
    todo, samples = np.arange(len(group)), samples_of(frames)
    while len(todo):
        bundle = _bundle(pose, frames, samples, moving).some(todo)
        found = common_motion(bundle, error)
        group[todo] = np.where(found >= 0, found + group.max() + 1, -1)
        failed, worst = _failing(pose, frames, moving, group, error)
        new = [frame for frame in dict.fromkeys(worst) if frame not in samples][:MORE]
        if not new:  # each alone does what together they do not
            _dissolve(group, failed, moving.sizes)
            failed, _ = _failing(pose, frames, moving, group, error)
            group[np.isin(group, failed)] = -1
            break
        sizes = np.bincount(group[group >= 0])
        alone = [number for number in failed if sizes[number] == 1]
        group[np.isin(group, alone)] = -1
        todo = np.flatnonzero(np.isin(group, failed))
        group[todo] = -1
        samples = sorted([*samples, *new])
    return group


def _bundle(
    pose: Callable[[int], np.ndarray], frames: range, samples: list[int], moving: Moving
) -> Bundle:
    poses = np.stack([pose(frame)[moving.vertices] for frame in samples])
    return Bundle(pose(frames[0])[moving.vertices], poses, moving.starts, moving.sizes)


def _failing(
    pose: Callable[[int], np.ndarray],
    frames: range,
    moving: Moving,
    group: np.ndarray,
    error: float,
) -> tuple[list[int], list[int]]:
    """Groups that fail in some frame, and the worst frame of each, by how badly they do."""
    of_vertex = group[moving.piece]
    rows = np.argsort(of_vertex, kind="stable")[(of_vertex < 0).sum() :]
    if not len(rows):
        return [], []
    numbers, starts = np.unique(of_vertex[rows], return_index=True)
    vertices = moving.vertices[rows]
    rest = pose(frames[0])[vertices]
    followed = follow(pose, frames, vertices, rest, starts, error)
    bad = np.flatnonzero(~followed.holds(error))
    bad = bad[np.argsort(-followed.residual[bad], kind="stable")]
    return numbers[bad].tolist(), [frames[k] for k in followed.worst[bad].tolist()]


def _dissolve(group: np.ndarray, failed: list[int], sizes: np.ndarray):
    """Make each piece of groups that fail one of its own, in place; none of small ones."""
    apart = np.flatnonzero(np.isin(group, failed))
    group[apart] = np.where(sizes[apart] >= LEAST, group.max() + 1 + np.arange(len(apart)), -1)
