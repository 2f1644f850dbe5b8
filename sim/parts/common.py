"""Which pieces of a mesh move as one: common affine motion."""

from dataclasses import dataclass

import numpy as np

from sim.parts.motion import Groups, applied, invertible

LEAST = 6
"""Vertices that an instance is worth: of it five words change, three rows and two corners."""
SLACK = 64
"""Errors by which a piece may miss the map of another, and is still tried in a fit of both: the
map of a small piece is less sure far away from it."""
TRIES = 8
"""Pieces that are tried so, one after the other."""
MISSES = 256
"""Pieces smaller than LEAST in a row, in random order, that are tried without finding a group: one
that has a fiftieth of all such pieces is then missed once in 170 times."""


@dataclass(frozen=True)
class Bundle:
    """Pieces of a mesh, their vertices one piece after the other.

    Attributes
    ----------
    rest : (n, 3) float64
    poses : (S, n, 3) float64
        Of sampled frames.
    starts : (K,) int
        First vertex of each piece.
    sizes : (K,) int
        Distinct vertices of each piece: those of a seam count once.
    """

    rest: np.ndarray
    poses: np.ndarray
    starts: np.ndarray
    sizes: np.ndarray

    def some(self, pieces: np.ndarray) -> "Bundle":
        """Of some pieces (k,), ascending."""
        counts = np.diff(self.starts, append=len(self.rest))[pieces]
        starts = np.cumsum(counts) - counts
        rows = np.repeat(self.starts[pieces] - starts, counts) + np.arange(counts.sum())
        return Bundle(self.rest[rows], self.poses[:, rows], starts, self.sizes[pieces])


def common_motion(bundle: Bundle, error: float) -> np.ndarray:
    """Group (K,) of each piece, numbered from 0; -1 for those of none.

    Pieces of a group follow one affine map in all poses, to within `error`, and have LEAST vertices
    together: any map takes a single triangle along, which says nothing. The map of a piece is tried
    on all others, the largest piece first, and fitted again to all that follow it, until no other
    does: as Lloyd's relaxation does with clusters of triangles in the lecture, but for an error
    that is given, so that the number of groups is not.
    """
    group = np.full(len(bundle.starts), -1)
    affine, extents, rank = _affine(bundle, error)
    small = bundle.sizes < LEAST
    large = np.flatnonzero(affine & ~small)
    large = large[np.lexsort((-extents[large], -rank[large]))]
    chance = np.random.default_rng(0).permutation(np.flatnonzero(affine & small))
    count = misses = 0
    for seed in [*large.tolist(), *chance.tolist()]:
        if group[seed] >= 0:
            continue
        if misses == MISSES:
            break
        members = _followers(bundle, seed, np.flatnonzero(affine & (group < 0)), error)
        if bundle.sizes[members].sum() >= LEAST:
            group[members] = count
            count, misses = count + 1, 0
        else:
            misses += 1
    return group


def _affine(bundle: Bundle, error: float):
    """Of each piece whether it moves affinely in all poses, its extent and its rank, all (K,)."""
    groups = Groups(bundle.rest, bundle.starts, error)
    affine = np.ones(len(bundle.starts), bool)
    for pose in bundle.poses:
        fit = groups.fit(pose)
        affine &= (groups.largest(fit.distances) <= error) & invertible(fit.maps)
    return affine, groups.extents[:, 0], groups.rank


def _followers(bundle: Bundle, seed: int, free: np.ndarray, error: float) -> np.ndarray:
    """Those of the free pieces that move as the seed does, with it; ascending."""
    members = np.array([seed])
    while True:
        near, missed = _near(bundle, free, _maps(bundle.some(members), error), SLACK * error)
        follow = np.union1d(members, near[missed <= error])
        if len(follow) > len(members):
            follow = follow[_apart(bundle, follow, error) <= error]
        if len(follow) <= len(members) or seed not in follow:
            # None follows at once: those that come nearest may do so in a fit of all.
            tried = near[np.argsort(missed, kind="stable")]
            tried = tried[~np.isin(tried, members)][:TRIES]
            unions = (np.union1d(members, piece) for piece in tried)
            follow = next((u for u in unions if (_apart(bundle, u, error) <= error).all()), members)
        if len(follow) <= len(members):
            return members
        members = follow


def _maps(bundle: Bundle, error: float) -> np.ndarray:
    """One map (S, 3, 4) of all pieces in each pose."""
    groups = Groups(bundle.rest, np.zeros(1, np.int64), error)
    return np.concatenate([groups.fit(pose).maps for pose in bundle.poses])


def _near(
    bundle: Bundle, free: np.ndarray, maps: np.ndarray, most: float
) -> tuple[np.ndarray, np.ndarray]:
    """Pieces that maps take along but for `most`, and by how much they miss them.

    By their first vertices, then by all.
    """
    for matrix, pose in zip(maps, bundle.poses, strict=True):
        first = bundle.starts[free]
        free = free[_length(applied(matrix, bundle.rest[first]) - pose[first]) <= most]
    if not len(free):
        return free, np.zeros(0)
    missed = _missed(bundle.some(free), maps)
    return free[missed <= most], missed[missed <= most]


def _apart(bundle: Bundle, pieces: np.ndarray, error: float) -> np.ndarray:
    """How far each of some pieces misses the one fit of all of them."""
    some = bundle.some(pieces)
    return _missed(some, _maps(some, error))


def _missed(bundle: Bundle, maps: np.ndarray) -> np.ndarray:
    """Largest distance (K,) of a vertex of each piece from where maps take it, in all poses."""
    distances = np.zeros(len(bundle.rest))
    for matrix, pose in zip(maps, bundle.poses, strict=True):
        np.maximum(distances, _length(applied(matrix, bundle.rest) - pose), out=distances)
    return np.maximum.reduceat(distances, bundle.starts)


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.linalg.norm(vectors, axis=-1)
