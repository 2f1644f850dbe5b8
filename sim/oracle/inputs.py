"""What the oracle takes: a mesh and rays, checked."""

import numpy as np


def corners_of(vertices, faces) -> np.ndarray:
    """Corners (T, 3, 3) of all triangles; raises ValueError as sim.oracle.trace.trace says."""
    vertices, faces = np.asarray(vertices, np.float64), np.asarray(faces, np.int64)
    if vertices.ndim != 2 or vertices.shape[1] != 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise ValueError(f"a mesh is (V, 3) and (T, 3), not {vertices.shape} and {faces.shape}")
    if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise ValueError(f"faces name vertices {faces.min()} to {faces.max()} of {len(vertices)}")
    corners = vertices[faces]
    finite = np.isfinite(corners).all(axis=(1, 2))
    if not finite.all():
        raise ValueError(f"triangle {finite.argmin()} is not finite")
    return corners


def check_rays(
    origins, directions, t_min, t_max
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """All four as float64; raises ValueError as sim.oracle.trace.trace says."""
    rays = [np.ascontiguousarray(x, np.float64) for x in (origins, directions, t_min, t_max)]
    count = len(rays[0])
    if [x.shape for x in rays] != [(count, 3)] * 2 + [(count,)] * 2:
        raise ValueError(f"rays are (n, 3), (n, 3), (n,), (n,), not {[x.shape for x in rays]}")
    finite = np.isfinite(rays[0]).all(axis=1) & np.isfinite(rays[1]).all(axis=1)
    if not finite.all():
        raise ValueError(f"ray {finite.argmin()} is not finite")
    return rays[0], rays[1], rays[2], rays[3]
