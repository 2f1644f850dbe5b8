"""`room`: a furnished room in which little moves."""

from collections.abc import Callable

import numpy as np

from sim.scene.builtin.furniture import FURNITURE, ROOM
from sim.scene.builtin.rotate import rotations
from sim.scene.builtin.shapes import box, check_size, grid, join, sphere
from sim.scene.scene import Scene

Mesh = tuple[np.ndarray, np.ndarray]

MOVING = 0.01  # of the triangles, where that is enough for the moving parts
SMALLEST_FAN, SMALLEST_BALL, SMALLEST_CLOTH = 60, 24, 24
SMALLEST_MOVING = SMALLEST_FAN + SMALLEST_BALL + SMALLEST_CLOTH
FAN_PLACE = np.array([0.2, 2.35, -0.1])
BALL_PLACE, BALL_RADIUS, BALL_HEIGHT = np.array([1.2, 0.0, 1.0]), 0.14, 1.3
CLOTH_CORNER, CLOTH_SIZE = np.array([-1.9, 0.35, -2.28]), np.array([1.7, 1.9])


def room(spec: str, triangles: int, frames: int) -> Scene:
    """A room in metres, y up, floor at 0, of which about 1 % moves: fan, ball and curtain.

    Walls and furniture stand still. The fan turns rigidly on the ceiling, the ball bounces, the
    curtain hangs from its rail before the back wall and flutters. Small rooms move more than 1 %.
    """
    smallest = len(still(np.inf)[1]) + SMALLEST_MOVING
    check_size(spec, triangles, smallest)
    budget = max(SMALLEST_MOVING, round(MOVING * triangles))
    parts: list[tuple[Mesh, Callable[[np.ndarray, float], np.ndarray]]] = [
        (fan(0.40 * budget), turning),
        (ball(0.25 * budget), bouncing),
        (cloth(0.35 * budget), fluttering),
    ]
    moving = sum(len(faces) for (_, faces), _ in parts)
    resting, _ = standing = fit_still(triangles - moving)
    _, faces = join([standing, *(mesh for mesh, _ in parts)])

    def pose(frame: int) -> np.ndarray:
        moved = [move(vertices, frame / frames) for (vertices, _), move in parts]
        return np.concatenate([resting, *moved])

    return Scene(spec, faces, frames, pose)


def still(cell: float) -> Mesh:
    """Walls and furniture in cells of about `cell` metres."""
    low, high = ROOM
    vertices, faces = box(low, high, cell)
    # the walls are seen from inside
    return join([(vertices, faces[:, ::-1]), *(box(low, high, cell) for low, high in FURNITURE)])


def fit_still(triangles: int) -> Mesh:
    """Walls and furniture of about `triangles` triangles."""
    fine, coarse = 1e-4, 10.0
    for _ in range(40):
        cell = (fine * coarse) ** 0.5
        boxes = [ROOM, *FURNITURE]
        if sum(box_triangles(low, high, cell) for low, high in boxes) > triangles:
            fine = cell
        else:
            coarse = cell
    return still(coarse)
