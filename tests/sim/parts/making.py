"""Scenes whose parts are known."""

from collections.abc import Callable

import numpy as np

from sim.scene.builtin.room import Mesh, joined
from sim.scene.builtin.shapes import grid, sphere
from sim.scene.scene import Scene

Motion = Callable[[np.ndarray, int], np.ndarray]


def ball(centre, triangles: int = 60) -> Mesh:
    points, faces = sphere(triangles)
    return points + np.asarray(centre), faces


def plate(centre, cells: int = 3) -> Mesh:
    uv, faces = grid(cells, cells)
    return np.stack([uv[:, 0], np.zeros(len(uv)), uv[:, 1]], axis=1) + np.asarray(centre), faces


def crumbs(count: int, rng: np.random.Generator, size: float = 0.1) -> Mesh:
    """Triangles that share no vertex."""
    points = rng.uniform(-1, 1, (count, 1, 3)) + size * rng.normal(size=(count, 3, 3))
    return points.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def scene_of(frames: int, *things: tuple[Mesh, Motion | None]) -> Scene:
    """Things that move on their own; vertices of each follow those of the one before."""
    rest, faces = joined(*(mesh for mesh, _ in things))
    ends = np.cumsum([len(points) for (points, _), _ in things])
    moving = [
        (slice(end - len(points), end), motion)
        for ((points, _), motion), end in zip(things, ends, strict=True)
        if motion
    ]

    def pose(frame: int) -> np.ndarray:
        vertices = rest.copy()
        for place, motion in moving:
            vertices[place] = motion(rest[place], frame)
        return vertices

    return Scene("things", faces.astype(np.int32), frames, pose)


def affine(rng: np.random.Generator, frames: int) -> Motion:
    """A random affine motion, at rest in frame 0."""
    linear = np.eye(3) + 0.4 * rng.uniform(-1, 1, (frames, 3, 3))
    shift = rng.uniform(-2, 2, (frames, 3))
    linear[0], shift[0] = np.eye(3), 0
    return lambda points, frame: points @ linear[frame].T + shift[frame]


def rigid(rng: np.random.Generator, frames: int) -> Motion:
    """A random rigid motion, at rest in frame 0."""
    linear, _ = np.linalg.qr(rng.normal(size=(frames, 3, 3)))
    linear *= np.linalg.det(linear)[:, np.newaxis, np.newaxis]
    shift = rng.uniform(-2, 2, (frames, 3))
    linear[0], shift[0] = np.eye(3), 0
    return lambda points, frame: points @ linear[frame].T + shift[frame]


def bend(points: np.ndarray, frame: int) -> np.ndarray:
    """Along y, by the square of x."""
    return points + 0.02 * frame * np.stack(
        [np.zeros(len(points)), points[:, 0] ** 2, np.zeros(len(points))], axis=1
    )


def with_noise(motion: Motion, size: float, seed: int) -> Motion:
    """Each vertex up to `size` away on each axis, some of them fully; never in frame 0."""

    def noisy(points: np.ndarray, frame: int) -> np.ndarray:
        signs = np.random.default_rng((seed, frame)).choice([-1.0, 1.0], points.shape)
        return motion(points, frame) + size * signs * (frame > 0)

    return noisy


def with_loose_vertex(scene: Scene, at: int) -> Scene:
    """A scene with one vertex more, which no triangle uses and which moves."""
    faces = np.where(scene.faces >= at, scene.faces + 1, scene.faces).astype(np.int32)
    return Scene(
        scene.name, faces, scene.frames, lambda k: np.insert(scene.pose(k), at, 0.1 * k, axis=0)
    )


def shuffled(tiles: int) -> Scene:
    """Bent tiles of shared vertices that lie side by side in other places each frame."""
    side = 4
    rows, columns = np.divmod(np.arange(side * side), side)
    corner = np.flatnonzero((rows < side - 1) & (columns < side - 1))
    square = np.stack([corner, corner + 1, corner + side, corner + side + 1], axis=1)
    tile = square[:, [[0, 1, 2], [1, 3, 2]]].reshape(-1, 3)
    faces = tile + side * side * np.arange(tiles)[:, None, None]
    flat = np.stack([columns, rows, 0 * rows], axis=1) * 0.3

    def pose(frame):
        rng = np.random.default_rng(frame)
        across, down = np.divmod(rng.permutation(tiles), 8)
        places = np.stack([across, down, 0 * across], axis=1)
        bent = flat + rng.normal(0, 0.1, (tiles, *flat.shape))
        return (bent + places[:, None]).reshape(-1, 3)

    return Scene("shuffled", faces.reshape(-1, 3).astype(np.int32), 6, pose)
