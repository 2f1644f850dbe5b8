"""Meshes to build trees over: (vertices, faces)."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp


def soup(rng: np.random.Generator, triangles: int, size: float = 0.1):
    """Triangles that share no vertex, anywhere in the unit cube."""
    centres = rng.random((triangles, 1, 3))
    vertices = (centres + size * rng.standard_normal((triangles, 3, 3))).reshape(-1, 3)
    return vertices, np.arange(3 * triangles, dtype=np.int32).reshape(-1, 3)


def exponential(triangles: int, factor: float):
    """Nested triangles, each larger than the last by a factor: the least cost is a chain."""
    corners = np.eye(3) + [[1, 1, 0], [0, 1, 1], [1, 0, 1]]
    vertices = (factor ** np.arange(triangles)[:, None, None] * corners).reshape(-1, 3)
    return vertices, np.arange(3 * triangles, dtype=np.int32).reshape(-1, 3)


def bumpy_sphere(subdivisions: int):
    """An octahedron whose faces are cut in four so many times: 8 * 4**subdivisions triangles."""
    vertices = np.concatenate([np.eye(3), -np.eye(3)])
    faces = np.array([[x, y, z] for x in (0, 3) for y in (1, 4) for z in (2, 5)])
    for _ in range(subdivisions):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2)
        edges, index = np.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
        a, b, c = faces.T
        ab, bc, ca = index.reshape(-1, 3).T + len(vertices)
        vertices = np.concatenate([vertices, vertices[edges].mean(axis=1)])
        faces = np.stack([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]], axis=1)
        faces = faces.reshape(3, -1).T
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    bumps = 1 + 0.2 * np.sin(7 * vertices[:, :1]) * np.cos(5 * vertices[:, 1:2])
    return vertices * bumps, faces.astype(np.int32)


@st.composite
def awkward_meshes(draw, most: int = 40):
    """Few vertices and many triangles: duplicates, degenerate ones, equal coordinates."""
    coordinates = draw(
        st.sampled_from([
            st.integers(-3, 3).map(float),
            st.sampled_from([0.0, -0.0, 1e-300, 1e300, -1e300, 1.0, 1 + 2**-52]),
            st.floats(-10, 10),
        ])
    )
    count = draw(st.integers(1, 12))
    vertices = draw(hnp.arrays(np.float64, (count, 3), elements=coordinates))
    triangles = draw(st.integers(1, most))
    corners = st.integers(0, count - 1)
    return vertices, draw(hnp.arrays(np.int32, (triangles, 3), elements=corners))
