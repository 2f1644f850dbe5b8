"""Smooth closed surfaces around a body of unit cubes.

Cubes on an integer lattice that share faces make a coarse closed quad mesh, the cage. Once every
lattice point has a place in space, Catmull-Clark subdivision turns the cage into a smooth surface
(Catmull, Clark, "Recursively generated B-spline surfaces on arbitrary topological meshes", 1978),
which is then sampled with any number of cells in each slab of the lattice: so the mesh may have
any size, and is closed whatever the places are.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from sim.scene.builtin.shapes import split_quads


@dataclass(frozen=True)
class Surface:
    """Quads over lattice points, and what is known at each point.

    Attributes
    ----------
    lattice : (N, 3) int64
        Where each vertex is on the lattice, in units of 1/scale.
    quads : (Q, 4) int64
        Counterclockwise from outside.
    values : (N, C) float64
    scale : int
    """

    lattice: np.ndarray
    quads: np.ndarray
    values: np.ndarray
    scale: int


def cage(cubes: set[tuple[int, int, int]], values: np.ndarray) -> Surface:
    """The outside of `cubes`, named by their lowest corners.

    `values` (X, Y, Z, C) are by lattice point.

    Cubes that meet at an edge must be joined around it by a third, or the edge has four quads.
    """
    corners = []
    for cube in sorted(cubes):
        for axis, side in product(range(3), (0, 1)):
            beyond = list(cube)
            beyond[axis] += 2 * side - 1
            if tuple(beyond) in cubes:
                continue
            square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)][:: 2 * side - 1])
            quad = np.full((4, 3), cube)
            quad[:, axis] += side
            quad[:, [(axis + 1) % 3, (axis + 2) % 3]] += square
            corners.append(quad)
    lattice, quads = np.unique(np.concatenate(corners), axis=0, return_inverse=True)
    return Surface(lattice, quads.reshape(-1, 4), values[tuple(lattice.T)], 1)


def subdivide(surface: Surface) -> Surface:
    """One step of Catmull-Clark: four quads for each."""
    quads, points = surface.quads, surface.values
    count, vertices = len(quads), len(points)
    ends = np.sort(np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    codes, edge = np.unique(ends @ (vertices, 1), return_inverse=True)
    ends = np.stack(np.divmod(codes, vertices), axis=1)
    # the surface is closed: each edge comes twice, so sorting by edge pairs its two quads
    beside = np.argsort(edge, kind="stable").reshape(-1, 2) // 4

    centres = points[quads].mean(axis=1)
    middles = points[ends].mean(axis=1)
    on_edges = (middles + centres[beside].mean(axis=1)) / 2
    valence = np.bincount(quads.ravel(), minlength=vertices)[:, np.newaxis]
    around = np.zeros_like(points)
    np.add.at(around, quads, centres[:, np.newaxis])
    np.add.at(around, ends, 2 * middles[:, np.newaxis])
    on_vertices = (around / valence + (valence - 3) * points) / valence

    lattice = surface.lattice
    edge = vertices + edge.reshape(count, 4)
    centre = np.broadcast_to((vertices + len(codes) + np.arange(count))[:, np.newaxis], (count, 4))
    return Surface(
        np.concatenate([2 * lattice, lattice[ends].sum(axis=1), lattice[quads].sum(axis=1) // 2]),
        np.stack([quads, edge, centre, np.roll(edge, 1, axis=1)], axis=-1).reshape(-1, 4),
        np.concatenate([on_vertices, on_edges, centres]),
        2 * surface.scale,
    )


def refine(base: Surface, counts: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Cut each slab i of axis a of the lattice into counts[a][i] cells.

    Returns the vertices' places on the lattice (V, 3) float64, in units of the base's lattice,
    and the faces (T, 3) int32.
    """
    ticks = [
        np.append(np.concatenate([i + np.arange(n) / n for i, n in enumerate(c)]), len(c))
        for c in counts
    ]
    starts = [np.concatenate([[0], np.cumsum(c)]) for c in counts]
    sizes = [len(t) for t in ticks]
    strides = np.array([sizes[1] * sizes[2], sizes[2], 1])
    corners = np.stack([starts[a][base.lattice[:, a]] for a in range(3)], axis=1) @ strides
    fine = []
    for quad in base.quads:
        a, b, _, d = base.lattice[quad]
        cells = [
            int(counts[axis][min(a[axis], o[axis])])
            for o in (b, d)
            for axis in np.flatnonzero(o - a)
        ]
        origin, right, _, up = corners[quad]
        s, t = np.arange(cells[0] + 1), np.arange(cells[1] + 1)
        codes = origin + np.add.outer(
            s * ((right - origin) // cells[0]), t * ((up - origin) // cells[1])
        )
        fine.append(
            np.stack(
                [codes[:-1, :-1], codes[1:, :-1], codes[1:, 1:], codes[:-1, 1:]], axis=-1
            ).reshape(-1, 4)
        )
    codes, quads = np.unique(np.concatenate(fine), return_inverse=True)
    places = np.unravel_index(codes, sizes)
    return np.stack([t[p] for t, p in zip(ticks, places, strict=True)], axis=1), split_quads(
        quads.reshape(-1, 4)
    )


def sample(surface: Surface, places: np.ndarray) -> np.ndarray:
    """The values (V, C) of a surface at `places` (V, 3) on it, bilinear within its quads."""
    places = places * surface.scale
    low, high = np.floor(places).astype(np.int64), np.ceil(places).astype(np.int64)
    fraction = places - low
    strides = np.array([1 << 42, 1 << 21, 1])
    codes = surface.lattice @ strides
    order = np.argsort(codes)
    codes = codes[order]
    result = np.zeros((len(places), surface.values.shape[1]))
    for corner in product((False, True), repeat=3):
        weight = np.where(corner, fraction, 1 - fraction).prod(axis=1)
        at = np.searchsorted(codes, np.where(corner, high, low) @ strides)
        result += weight[:, np.newaxis] * surface.values[order[at]]
    return result
