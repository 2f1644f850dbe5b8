"""Meshes and points of the cases: vertices (V, 3) float64 and faces (T, 3) int32."""

import numpy as np


def icosphere(cuts: int) -> tuple[np.ndarray, np.ndarray]:
    """A closed unit sphere of 20 * 4**cuts triangles: an icosahedron whose edges are halved."""
    golden = (1 + 5**0.5) / 2
    short = np.array([(0, a, b) for a in (-1, 1) for b in (-golden, golden)])
    vertices = np.concatenate([np.roll(short, k, axis=1) for k in range(3)])
    near = np.linalg.norm(vertices[:, None] - vertices, axis=2) < 2.1  # edges have length 2
    triples = ((a, b, c) for a in range(12) for b in range(a) for c in range(b))
    faces = np.array([
        t for t in triples if near[t[0], t[1]] and near[t[1], t[2]] and near[t[0], t[2]]
    ])
    for _ in range(cuts):
        edges, index = edges_of(faces)
        a, b, c = faces.T
        ab, bc, ca = index.T + len(vertices)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        faces = np.concatenate([
            np.stack(f, axis=1) for f in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
        ])
    return vertices / np.linalg.norm(vertices, axis=1, keepdims=True), faces.astype(np.int32)


def edges_of(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edges (E, 2) of a mesh, and which of them (T, 3) run from each corner to the next."""
    ends = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    edges, index = np.unique(ends, axis=0, return_inverse=True)
    return edges, index.reshape(-1, 3)


def middles(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Midpoints (E, 3) of all edges."""
    return vertices[edges_of(faces)[0]].mean(axis=1)


def cube(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The closed cube [-1, 1]^3, each side cells x cells quads: all vertices on its planes."""
    steps = np.arange(cells + 1)
    lattice = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    points, quads = [], []
    for axis in range(3):
        for end in (0, cells):
            first = sum(map(len, points))
            points.append(np.insert(lattice, axis, end, axis=1))
            i, j = np.meshgrid(steps[:-1], steps[:-1], indexing="ij")
            corner = first + (i * (cells + 1) + j).ravel()
            quads.append(corner[:, None] + [0, 1, cells + 2, cells + 1])
    unique, index = np.unique(np.concatenate(points), axis=0, return_inverse=True)
    faces = index.ravel()[np.concatenate(quads)][:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
    return 2.0 * unique / cells - 1, faces.astype(np.int32)


def ball(rng: np.random.Generator, count: int, radius: float) -> np.ndarray:
    """Points (count, 3), even in a ball around 0."""
    return units(rng, count) * radius * np.cbrt(rng.random((count, 1)))


def units(rng: np.random.Generator, count: int) -> np.ndarray:
    """Unit vectors (count, 3), even over the sphere."""
    return unit(rng.normal(size=(count, 3)))


def unit(vectors: np.ndarray) -> np.ndarray:
    """Vectors (..., 3) of length 1, also where a square leaves the range of float64."""
    vectors = vectors / np.abs(vectors).max(axis=-1, keepdims=True)
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
