"""`fleet`: ships that sail over a calm sea."""

import numpy as np

from sim.scene.builtin.room import Mesh, ball, joined, panel
from sim.scene.builtin.rotate import rotations
from sim.scene.builtin.shapes import check_size, sphere
from sim.scene.scene import Scene

SMALLEST = 300  # triangles
SHIPS = 8
SEA = 0.1
"""Share of all triangles."""
RADIUS = 3.0  # of the circle that they sail on
ROLL = 0.15  # radians, to each side
SIZES = 1.0, 0.6
X, Y, Z = np.eye(3)


def fleet(spec: str, triangles: int, frames: int) -> Scene:
    """Eight ships of one shape, rigid and of two sizes, on a circle that they sail once a period.

    Each rolls as it goes. The sea is at rest; y is up. Of 80,000 triangles a ship has 9,000: all
    that changes from frame to frame are eight transformations of one geometry.
    """
    check_size(spec, triangles, SMALLEST)
    points, faces = ship(round((1 - SEA) * triangles / SHIPS))
    side = RADIUS + 1
    left = max(triangles - SHIPS * len(faces), 2)
    sea = panel(left, (-side, 0, -side), (0, 0, 2 * side), (2 * side, 0, 0))
    rest, all_faces = joined(sea, *[(points, faces)] * SHIPS)
    first = len(sea[0])

    def pose(frame: int) -> np.ndarray:
        vertices = rest.copy()
        for k in range(SHIPS):
            place = slice(first + k * len(points), first + (k + 1) * len(points))
            along = 2 * np.pi * (k / SHIPS + frame / frames)
            roll = ROLL * np.sin(2 * np.pi * (3 * frame / frames + k / SHIPS))
            turned = SIZES[k % len(SIZES)] * (points @ rotations(Z, roll).T)
            vertices[place] = (turned + RADIUS * X) @ rotations(Y, along).T
        return vertices

    return Scene(spec, all_faces.astype(np.int32), frames, pose)


def ship(triangles: int) -> Mesh:
    """A hull along z, a deckhouse and a mast."""
    house = ball(max(round(0.25 * triangles), 6), (0, 0.3, 0.1), 0.12)
    points, faces = sphere(max(round(0.05 * triangles), 6))
    mast = points * (0.02, 0.35, 0.02) + (0, 0.5, -0.2), faces
    points, faces = sphere(max(triangles - len(house[1]) - len(mast[1]), 6))
    hull = points * (0.2, 0.18, 0.7) + 0.1 * Y, faces
    return joined(hull, house, mast)
