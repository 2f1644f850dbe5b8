"""When a refitted tree is worse than a new one, and what a new one takes."""

from collections.abc import Callable, Sequence

from sim.scene.scene import Scene
from sim.tree.build import build
from sim.tree.cost import pose_cost
from sim.tree.tree import Tree

HOST_SECONDS = 3e-6
"""Of a triangle, to build and compile its tree on the host: assumed. Measured for one pose of the
elephant, on one core of a server: 2.0 us to build, 1.1 us to compile."""


def refitted_cost(scene: Scene, tree: Tree, frame: int) -> float:
    """SAH cost of a tree that is refitted to a frame."""
    return pose_cost(tree, scene.pose(frame), scene.faces)


def rebuilt_cost(scene: Scene, frame: int) -> float:
    """SAH cost of a tree that is built for a frame, in that frame."""
    vertices = scene.pose(frame)
    return pose_cost(build(vertices, scene.faces), vertices, scene.faces)


def first_above(
    frames: Sequence[int], values: Sequence[float], value: Callable[[int], float], most: float
) -> int | None:
    """The first frame whose value is above `most`. None, if none is in the samples.

    Parameters
    ----------
    frames : sequence of int
        The samples, ascending.
    values : sequence of float
        The value of each sample.
    value : callable
        From a frame to its value, for others. It is taken to pass `most` once between samples.
    most : float

    Returns
    -------
    int or None
        Found by bisection between the first such sample and the one before it.
    """
    late = next((k for k, found in enumerate(values) if found > most), None)
    if not late:
        return None if late is None else frames[0]
    low, high = frames[late - 1], frames[late]
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if value(middle) > most else (middle, high)
    return high
