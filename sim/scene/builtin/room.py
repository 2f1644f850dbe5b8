"""`room`: a room that stands still, and a few things in it that move."""

from collections.abc import Callable

import numpy as np

from sim.scene.builtin.rotate import rotations
from sim.scene.builtin.shapes import check_size, grid, sphere
from sim.scene.scene import Scene

Mesh = tuple[np.ndarray, np.ndarray]
Motion = Callable[[np.ndarray, float], np.ndarray]

SMALLEST = 300  # triangles
WIDTH, HEIGHT, DEPTH = 6.0, 3.0, 5.0
HUB = np.array([3.0, 2.7, 2.5])
UP = np.array([0.0, 1.0, 0.0])


def room(spec: str, triangles: int, frames: int) -> Scene:
    """A floor, two walls, a table and a vase at rest; a fan, a ball and a curtain move.

    One triangle in a hundred moves: the fan turns as a whole, the ball bounces, the curtain
    flutters. Metres.
    """
    check_size(spec, triangles, SMALLEST)
    parts = [(make(max(round(share * triangles), 1)), motion) for share, make, motion in PARTS]
    left = triangles - sum(len(faces) for (_, faces), _ in parts)
    parts.append((panel(max(left, 2), (0, 0, 0), (0, 0, DEPTH), (WIDTH, 0, 0)), None))  # floor

    starts = np.cumsum([0] + [len(points) for (points, _), _ in parts])
    faces = [faces + start for ((_, faces), _), start in zip(parts, starts[:-1], strict=True)]
    rest = np.concatenate([points for (points, _), _ in parts])
    moving = [
        (slice(start, start + len(points)), motion)
        for ((points, _), motion), start in zip(parts, starts[:-1], strict=True)
        if motion
    ]

    def pose(frame: int) -> np.ndarray:
        vertices = rest.copy()
        for place, motion in moving:
            vertices[place] = motion(rest[place], frame / frames)
        return vertices

    return Scene(spec, np.concatenate(faces).astype(np.int32), frames, pose)


def panel(triangles: int, corner, across, along) -> Mesh:
    """A parallelogram in about so many triangles, its cells about square."""
    corner, across, along = (np.array(x, np.float64) for x in (corner, across, along))
    cells = max(1.0, triangles / 2)
    ratio = np.linalg.norm(across) / np.linalg.norm(along)
    columns = max(1, round((cells * ratio) ** 0.5))
    points, faces = grid(columns, max(1, round(cells / columns)))
    return corner + points @ np.stack([across, along]), faces


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one."""
    starts = np.cumsum([0] + [len(points) for points, _ in meshes[:-1]])
    return (
        np.concatenate([points for points, _ in meshes]),
        np.concatenate([faces + start for (_, faces), start in zip(meshes, starts, strict=True)]),
    )


def block(triangles: int, low, high) -> Mesh:
    """The six sides of a box."""
    low, high = np.array(low, np.float64), np.array(high, np.float64)
    x, y, z = np.diag(high - low)
    sides = [(low, y, x), (low, x, z), (low, z, y), (high, -x, -y), (high, -z, -x), (high, -y, -z)]
    return joined(*(panel(triangles // 6, *side) for side in sides))


def ball(triangles: int, centre, radius: float) -> Mesh:
    """A sphere."""
    points, faces = sphere(triangles)
    return np.array(centre) + radius * points, faces


def legs(triangles: int) -> Mesh:
    """The four legs of the table."""
    places = [(x, z) for x in (1.0, 2.9) for z in (1.0, 1.9)]
    return joined(*(block(triangles // 4, (x, 0, z), (x + 0.1, 0.7, z + 0.1)) for x, z in places))


def blades(triangles: int) -> Mesh:
    """Four blades about the hub of the fan, a little inclined."""
    points, faces = panel(triangles // 4, (0.15, 0.03, -0.1), (0.9, 0, 0), (0, -0.06, 0.2))
    turns = rotations(UP, np.pi / 2 * np.arange(4))
    return joined(*((HUB + points @ turn.T, faces) for turn in turns))


def turn(points: np.ndarray, time: float) -> np.ndarray:
    """The fan: two turns a period."""
    return HUB + (points - HUB) @ rotations(UP, 4 * np.pi * time).T


def bounce(points: np.ndarray, time: float) -> np.ndarray:
    """The ball: from the floor to 1.2 m and back, twice a period."""
    flight = 2 * time % 1
    return points + 4 * 1.2 * flight * (1 - flight) * UP


def flutter(points: np.ndarray, time: float) -> np.ndarray:
    """The curtain: waves that run down it, wider towards its lower edge."""
    loose = (2.5 - points[:, 1:2]) / 2.0
    wave = np.sin(2 * np.pi * (points[:, 1:2] + 1.5 * points[:, 0:1] + 2 * time))
    return points + 0.15 * loose * wave * np.array([0.0, 0.0, 1.0])


# Share of all triangles, mesh of a number of triangles, motion. The floor takes what is left.
PARTS: list[tuple[float, Callable[[int], Mesh], Motion | None]] = [
    (0.26, lambda n: panel(n, (0, 0, 0), (WIDTH, 0, 0), (0, HEIGHT, 0)), None),
    (0.24, lambda n: panel(n, (0, 0, 0), (0, HEIGHT, 0), (0, 0, DEPTH)), None),
    (0.06, lambda n: block(n, (0.9, 0.7, 0.9), (3.1, 0.8, 2.1)), None),
    (0.04, legs, None),
    (0.10, lambda n: ball(n, (2.0, 1.0, 1.5), 0.2), None),
    (0.003, blades, turn),
    (0.003, lambda n: ball(n, (4.5, 0.2, 3.0), 0.2), bounce),
    (0.004, lambda n: panel(n, (3.5, 0.5, 0.3), (2.0, 0, 0), (0, 2.0, 0)), flutter),
]
