"""`cloth`: a cloth that hangs by its corners, and is let go at two of them."""

from functools import cache

import numpy as np

from sim.scene.builtin.shapes import check_size, grid
from sim.scene.builtin.springs import Springs
from sim.scene.scene import Scene

CELLS = 20  # of the simulated cloth, along each side
SECONDS = 3.0  # of a period
STEPS = 240  # of the integration, in a period
RELEASE = STEPS // 3
SIDE, APART = 1.0, 0.9  # metres: of the cloth, and from corner to corner where it hangs
MASS, STIFFNESS, DAMPING = 0.5, 16000.0, 0.02  # of the cloth and of a spring; SI units
WEIGHT = np.array([0.0, -9.81 * MASS / (CELLS + 1) ** 2, 0.0])  # of a point; newtons


def cloth(spec: str, triangles: int, frames: int) -> Scene:
    """A square cloth of stiff springs; metres, y is up.

    For the first third of the period it hangs at rest by four corners, then it is let go at the
    two of z = 0 and swings down. The springs are stiff: an explicit step (symplectic Euler) is
    stable up to 2 / omega = 0.17 ms, omega the highest frequency. A frame of 24 takes 125 ms, 740
    times as long, a frame of 10,000 0.3 ms, 1.8 times, and a step of the integration 12.5 ms, 74
    times: so it is implicit. What is simulated has 441 points at any size; the mesh is
    interpolated, cubically in space and in time.
    """
    check_size(spec, triangles, 2)
    across = max(1, round((triangles / 2) ** 0.5))
    along = max(1, round(triangles / 2 / across))
    _, faces = grid(across, along)
    rows, columns = weights(across), weights(along)

    def pose(frame: int) -> np.ndarray:
        points, speeds = motion()
        step, late = divmod(STEPS * frame, frames)
        time, after = late / frames, min(step + 1, STEPS)
        hermite = np.array([
            (1 + 2 * time) * (1 - time) ** 2,
            time * (1 - time) ** 2 * SECONDS / STEPS,
            time**2 * (3 - 2 * time),
            time**2 * (time - 1) * SECONDS / STEPS,
        ])
        at = np.stack([points[step], speeds[step], points[after], speeds[after]])
        net = at[0] if step < RELEASE else np.tensordot(hermite, at, 1)
        net = net.reshape(CELLS + 1, CELLS + 1, 3)
        return np.einsum("ui,ijk,vj->uvk", rows, net, columns, optimize=True).reshape(-1, 3)

    return Scene(spec, faces, frames, pose)


def springs() -> Springs:
    """The net: springs along cells, across them, and over two of them against bending."""
    number = np.arange((CELLS + 1) ** 2).reshape(CELLS + 1, CELLS + 1)
    steps = [(0, 1), (1, 0), (1, 1), (1, -1), (0, 2), (2, 0)]
    ends, lengths = [], []
    for i, j in steps:
        first = number[: CELLS + 1 - i, max(0, -j) : CELLS + 1 - max(0, j)]
        second = number[i:, max(0, j) : CELLS + 1 - max(0, -j)]
        ends.append(np.stack([first.ravel(), second.ravel()], axis=1))
        lengths.append(np.full(first.size, np.hypot(i, j) * SIDE / CELLS))
    free = np.ones(number.size, bool)
    free[number[[0, 0, -1, -1], [0, -1, 0, -1]]] = False
    mass = MASS / number.size
    return Springs(np.concatenate(ends), np.concatenate(lengths), STIFFNESS, DAMPING, mass, free)


@cache
def motion() -> tuple[np.ndarray, np.ndarray]:
    """Points and speeds (STEPS + 1, 441, 3) in metres and metres a second, at each step."""
    net = springs()
    flat, _ = grid(CELLS, CELLS)
    points = np.stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]], axis=1) * APART
    still = speeds = np.zeros_like(points)
    for _ in range(60):  # to rest: implicit Euler takes energy out of what moves
        points, speeds = net.step(points, speeds, 0.03, WEIGHT)
    net.free[[0, CELLS * (CELLS + 1)]] = True  # the corners of z = 0
    moved = [(points, still)] * (RELEASE + 1)
    while len(moved) <= STEPS:
        moved.append(net.step(*moved[-1], SECONDS / STEPS, WEIGHT))
    places, rates = zip(*moved, strict=True)
    return np.stack(places), np.stack(rates)


def weights(cells: int) -> np.ndarray:
    """Catmull-Rom weights (cells + 1, CELLS + 1) of the net's points on a line of the mesh's."""
    at = np.arange(cells + 1) * CELLS / cells
    low = np.minimum(at.astype(int), CELLS - 1)
    t = (at - low)[:, np.newaxis]
    four = np.hstack([
        -t * (1 - t) ** 2,
        2 - 5 * t**2 + 3 * t**3,
        t + 4 * t**2 - 3 * t**3,
        t**2 * (t - 1),
    ])
    result = np.zeros((cells + 1, CELLS + 1))
    for k in range(4):
        place = low + k - 1
        np.add.at(result, (np.arange(cells + 1), np.clip(place, 0, CELLS)), four[:, k] / 2)
    return result
