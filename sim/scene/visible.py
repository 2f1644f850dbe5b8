"""What of a mesh is seen from a point: a coarse depth buffer in float64."""

import numpy as np
from numba import njit

GRAZING = 0.25
"""Least cosine at which a surface is credited with being seen: beyond 75 degrees it is not."""
BACK = 0.5
"""What the back of a triangle counts against its front."""


@njit(cache=True)
def project(points: np.ndarray, axes: np.ndarray, distance: float) -> np.ndarray:
    """Points (V, 3) as seen from -distance times forward: (V, 3) of right, down and depth.

    Right and down are on the plane at depth 1, `axes` (3, 3) are right, down and forward in rows.
    """
    result = np.empty_like(points)
    for k in range(len(points)):
        x, y, z = points[k]
        depth = axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z + distance
        scale = 1 / depth
        result[k, 0] = (axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z) * scale
        result[k, 1] = (axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z) * scale
        result[k, 2] = depth
    return result


@njit(cache=True)
def bounds(projected: np.ndarray) -> np.ndarray:
    """The window (4,) that just holds what `project` gave: left, top, right, bottom."""
    window = np.array([np.inf, np.inf, -np.inf, -np.inf])
    for k in range(len(projected)):
        for axis in range(2):
            window[axis] = min(window[axis], projected[k, axis])
            window[axis + 2] = max(window[axis + 2], projected[k, axis])
    return window


def visible(
    projected: np.ndarray, faces: np.ndarray, window: np.ndarray, columns: int, rows: int
) -> tuple[np.ndarray, np.ndarray]:
    """What each cell of a window sees at its middle.

    Parameters
    ----------
    projected : (V, 3) float64
        As `project` gives them; every depth is above 0.
    faces : (T, 3) int
    window : (4,) float64
        Left, top, right, bottom on the plane at distance 1.
    columns, rows : int
        Cells across and down.

    Returns
    -------
    covered : (rows, columns) bool
    surface : (rows, columns) float64
        Area of the mesh that the cell shows, about, in squares of the points' unit; less of it
        where it is GRAZING, and where it is a back.
    """
    cell = (window[2:] - window[:2]) / (columns, rows)
    triangle = np.full((rows, columns), -1, np.int64)
    nearest = np.zeros((rows, columns))
    _draw(projected, faces, window, cell, triangle, nearest)

    covered = triangle >= 0
    corner = projected[faces[triangle[covered]]]
    corner[..., :2] *= corner[..., 2:]  # from the plane to where they are
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    y, x = np.nonzero(covered)
    x, y = window[0] + (x + 0.5) * cell[0], window[1] + (y + 0.5) * cell[1]
    ray = np.stack([x, y, np.ones(len(x))], axis=1)
    reach = np.linalg.norm(ray, axis=1)
    length = np.linalg.norm(normal, axis=1) * reach
    along = (normal * ray).sum(axis=1)
    cosine = np.divide(along, length, out=np.ones(len(along)), where=length > 0)
    area = cell.prod() / (reach * np.maximum(np.abs(cosine), GRAZING) * nearest[covered] ** 2)
    surface = np.zeros((rows, columns))
    # right, down and forward are right-handed, so of a front the cosine is negative
    surface[covered] = np.where(cosine < 0, area, BACK * area)
    return covered, surface


@njit(cache=True)
def _draw(projected, faces, window, cell, triangle, nearest):
    """Nearest triangle at each cell's middle, and its 1 / depth, which is linear on the plane."""
    rows, columns = triangle.shape
    for face in range(len(faces)):
        a, b, c = faces[face]
        # in cells, whole numbers at their middles
        ax = (projected[a, 0] - window[0]) / cell[0] - 0.5
        ay = (projected[a, 1] - window[1]) / cell[1] - 0.5
        bx = (projected[b, 0] - window[0]) / cell[0] - 0.5
        by = (projected[b, 1] - window[1]) / cell[1] - 0.5
        cx = (projected[c, 0] - window[0]) / cell[0] - 0.5
        cy = (projected[c, 1] - window[1]) / cell[1] - 0.5
        area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay)
        if area == 0:
            continue
        left = int(np.ceil(min(max(min(ax, bx, cx), 0.0), columns)))
        right = int(np.floor(max(min(max(ax, bx, cx), columns - 1.0), -1.0)))
        top = int(np.ceil(min(max(min(ay, by, cy), 0.0), rows)))
        bottom = int(np.floor(max(min(max(ay, by, cy), rows - 1.0), -1.0)))
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                wa = ((bx - x) * (cy - y) - (cx - x) * (by - y)) / area
                wb = ((cx - x) * (ay - y) - (ax - x) * (cy - y)) / area
                wc = 1 - wa - wb
                if wa < 0 or wb < 0 or wc < 0:
                    continue
                depth = wa / projected[a, 2] + wb / projected[b, 2] + wc / projected[c, 2]
                if depth > nearest[y, x]:
                    nearest[y, x] = depth
                    triangle[y, x] = face
