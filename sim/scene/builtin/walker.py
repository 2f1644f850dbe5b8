"""`walker`: a person who walks."""

import numpy as np

from sim.scene.builtin.body import body
from sim.scene.builtin.cage import Surface, refine, sample, subdivide
from sim.scene.builtin.gait import motion
from sim.scene.builtin.shapes import check_size
from sim.scene.scene import Scene
from sim.scene.skin import skin

INFLUENCES = 4  # bones that move a vertex


def walker(spec: str, triangles: int, frames: int) -> Scene:
    """A skinned figure that walks on the spot: one closed surface, y up, facing z, in metres.

    One period is two steps.
    """
    base = body()
    single = [np.ones(n, np.int64) for n in base.lattice.max(axis=0)]
    check_size(spec, triangles, count_triangles(base, single))
    counts = slab_counts(base, triangles)
    places, faces = refine(base, counts)

    levels = [base]
    while levels[-1].scale < max(8, *(c.max() for c in counts)) and len(levels) <= 6:
        # bones' weights are smooth: past four steps only the shape is subdivided further
        last = levels[-1]
        kept = last.values if len(levels) <= 4 else last.values[:, :3]
        levels.append(subdivide(Surface(last.lattice, last.quads, kept, last.scale)))
    vertices = sample(levels[-1], places)[:, :3]
    weights = sample(levels[min(4, len(levels) - 1)], places)[:, 3:]
    joints = np.argpartition(weights, -INFLUENCES, axis=1)[:, -INFLUENCES:]
    weights = np.take_along_axis(weights, joints, axis=1)
    weights /= weights.sum(axis=1, keepdims=True)

    def pose(frame: int) -> np.ndarray:
        return skin(vertices, joints, weights, motion(frame / frames))

    return Scene(spec, faces, frames, pose)


def slab_lengths(base: Surface) -> list[np.ndarray]:
    """Mean length of the cage's edges that cross each slab of the lattice, by axis."""
    a, b = base.quads, np.roll(base.quads, -1, axis=1)
    lengths = np.linalg.norm(base.values[a, :3] - base.values[b, :3], axis=-1).ravel()
    start = np.minimum(base.lattice[a], base.lattice[b]).reshape(-1, 3)
    axis = (base.lattice[a] != base.lattice[b]).reshape(-1, 3).argmax(axis=1)
    result = []
    for k in range(3):
        slab = start[axis == k, k]
        result.append(np.bincount(slab, lengths[axis == k]) / np.bincount(slab))
    return result


def count_triangles(base: Surface, counts: list[np.ndarray]) -> int:
    """Triangles of the surface with counts[a][i] cells in slab i of axis a."""
    corners = base.lattice[base.quads]
    low = corners.min(axis=1)
    thick = corners.max(axis=1) > low
    cells = [np.where(thick[:, a], np.take(counts[a], low[:, a], mode="clip"), 1) for a in range(3)]
    return 2 * int(np.prod(cells, axis=0).sum())


def slab_counts(base: Surface, triangles: int) -> list[np.ndarray]:
    """Cells in each slab such that triangles are as many as wanted and about equal in size.

    Few slabs go around the body, so a cell more in one of them adds many triangles. Those are
    set first, from an even cell size, and the slabs along limbs then make up the difference.
    """
    lengths = slab_lengths(base)
    around = [np.zeros(len(n), bool) for n in lengths]
    around[0][8:11] = True
    around[2][0] = True

    def counts(cell: float, along: float) -> list[np.ndarray]:
        sizes = [np.where(a, cell, along) for a in around]
        return [
            np.maximum(1, np.rint(n / s)).astype(np.int64)
            for n, s in zip(lengths, sizes, strict=True)
        ]

    def fit(cell: float | None) -> float:
        low, high = 1e-5, 1e2
        for _ in range(40):  # to 1e-5 of the cell
            middle = (low * high) ** 0.5
            if count_triangles(base, counts(cell or middle, middle)) > triangles:
                low = middle
            else:
                high = middle
        return high

    even = fit(None)
    best = counts(even, even)
    for factor in 1.05 ** np.arange(0, 60):
        cell = even * factor
        along = fit(cell)
        trial = min(
            (counts(cell, a) for a in (along, along * (1 - 1e-9))),
            key=lambda c: abs(count_triangles(base, c) - triangles),
        )
        if abs(count_triangles(base, trial) - triangles) < abs(
            count_triangles(base, best) - triangles
        ):
            best = trial
        if abs(count_triangles(base, best) - triangles) <= 0.01 * triangles:
            break
    return best
