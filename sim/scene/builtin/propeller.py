"""`propeller`: an airship that turns slowly, its propeller fast, and its needle trembles."""

import numpy as np

from sim.scene.builtin.room import Mesh, ball, joined, panel
from sim.scene.builtin.rotate import rotations
from sim.scene.builtin.shapes import check_size, sphere
from sim.scene.scene import Scene

SMALLEST = 100  # triangles
BLADES = 4
TURN, SPIN, TREMBLE = 1, 1009, 1_003_819
"""Cycles a period. Of 24 or of 10,000 frames none of them is a whole number to a frame."""
AMPLITUDE = 0.02  # of the needle's end
X, Y, Z = np.eye(3)
NOSE, TAIL = 0.95, -0.85  # of the hull, on z
NEEDLE = 0.5


def propeller(spec: str, triangles: int, frames: int) -> Scene:
    """A hull with fins, four blades at its nose and a needle at its tail: rates 1 : 1e3 : 1e6.

    All of it turns about y once a period, the blades about z a thousand times as fast, and the
    needle bends to and fro a million times as fast, by little. Frame 0 is at the start of all
    three. In a period of 10,000 frames a blade turns by 36 degrees from frame to frame.
    """
    check_size(spec, triangles, SMALLEST)
    blades = [blade(round(0.3 * triangles / BLADES), k / BLADES) for k in range(BLADES)]
    parts = [joined(*blades), needle(round(0.1 * triangles)), *fins(round(0.05 * triangles))]
    parts.append(ball(round(0.05 * triangles), (0, 0, NOSE), 0.09))
    points, faces = sphere(triangles - sum(len(faces) for _, faces in parts))
    parts.append((points * (0.33, 0.33, 0.9), faces))
    rest, faces = joined(*parts)

    spinning = slice(len(parts[0][0]))
    trembling = slice(spinning.stop, spinning.stop + len(parts[1][0]))
    bend = ((TAIL - rest[trembling, 2]) / NEEDLE) ** 2  # as a rod that is held at one end

    def angle(cycles: int, frame: int) -> float:
        return 2 * np.pi * (cycles * frame % frames / frames)

    def pose(frame: int) -> np.ndarray:
        vertices = rest.copy()
        vertices[spinning] = rest[spinning] @ rotations(Z, angle(SPIN, frame)).T
        vertices[trembling, 0] += AMPLITUDE * bend * np.sin(angle(TREMBLE, frame))
        return vertices @ rotations(Y, angle(TURN, frame)).T

    return Scene(spec, faces.astype(np.int32), frames, pose)


def blade(triangles: int, turn: float) -> Mesh:
    """A blade of the propeller, twisted from its root to its end, `turn` turns about z."""
    points, faces = panel(triangles, (0.05, -0.09, 0), (0.55, 0, 0), (0, 0.18, 0))
    twist = rotations(X, 1.1 - 1.2 * points[:, 0])
    points = np.einsum("vij,vj->vi", twist, points) + NOSE * Z
    return points @ rotations(Z, 2 * np.pi * turn).T, faces


def needle(triangles: int) -> Mesh:
    """A thin spindle that goes on from the tail."""
    points, faces = sphere(triangles)
    return points * (0.02, 0.02, NEEDLE / 2) + (TAIL - NEEDLE / 2) * Z, faces


def fins(triangles: int) -> list[Mesh]:
    """An upright and a level fin, near the tail."""
    corners = [((0, -0.4, -0.8), (0, 0.8, 0)), ((-0.4, 0, -0.8), (0.8, 0, 0))]
    return [panel(triangles, corner, across, (0, 0, 0.25)) for corner, across in corners]
