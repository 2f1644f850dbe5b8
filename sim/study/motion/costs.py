"""What a refitted tree costs beside a new one, and from when on the new one is worth it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sim.scene.scene import Scene
from sim.tree.rebuild import HOST_SECONDS, first_above, rebuilt_cost, refitted_cost
from sim.tree.tree import Tree

CYCLES_PER_STEP = 0.25
"""Of one ray: four rays of a packet take a step in a cycle. Measured, of 512 x 386 camera rays
from memory of 32 cycles latency: 0.17 on the elephant (most rays end early), 0.27 on the walker."""
FORMULA = (
    "refit stops paying in the first frame with update + (SAH refitted - SAH rebuilt) x rays x "
    "cycles_per_step > triangles x host_seconds x clock + words"
)


@dataclass(frozen=True)
class Prices:
    """What a frame costs, in cycles of the machine.

    A refit takes `update` cycles. For a rebuild the machine waits until the host has built and
    compiled the tree, and then until all `words` of the memory image are written, one a cycle: a
    new tree has its leaves, vertices and program in another order, so hardly a word stays.
    Rays then take SAH cost x rays x CYCLES_PER_STEP in either tree: all of them meet the scene's
    box, as with a camera that it fills.

    Attributes
    ----------
    triangles, words, rays, update : int
    clock_mhz : float
    """

    triangles: int
    words: int
    rays: int
    update: int
    clock_mhz: float

    @property
    def rebuild(self) -> float:
        return self.triangles * HOST_SECONDS * self.clock_mhz * 1e6 + self.words

    @property
    def most(self) -> float:
        """SAH cost by which a refitted tree may be above a new one, and is still worth it."""
        return (self.rebuild - self.update) / (self.rays * CYCLES_PER_STEP)


def excess(scene: Scene, tree: Tree, frame: int) -> float:
    """SAH cost of a refitted tree above that of a new one."""
    return refitted_cost(scene, tree, frame) - rebuilt_cost(scene, frame)


def stops(
    scene: Scene, tree: Tree, frames: Sequence[int], above: Sequence[float], prices: Prices
) -> int | None:
    """The first frame in which refit does not pay: FORMULA. None, if it pays in all samples.

    Parameters
    ----------
    scene : Scene
    tree : Tree
        The refitted one.
    frames : sequence of int
        The samples, ascending.
    above : sequence of float
        `excess` at each sample.
    prices : Prices

    Returns
    -------
    int or None
        Found by bisection between the first such sample and the one before it.
    """
    return first_above(frames, above, lambda frame: excess(scene, tree, frame), prices.most)


def repaid(
    scene: Scene, tree: Tree, frames: Sequence[int], above: Sequence[float], prices: Prices
) -> int | None:
    """The first frame by which one rebuild is paid for by what the frames up to it have lost.

    All that the refitted tree costs above new ones since the first frame, added up, is then more
    than a rebuild costs above a refit: by the trapezoid rule from sample to sample, and frame by
    frame after the last of them by which it is not. None, if it never is. Parameters are those of
    `stops`.
    """
    lost = np.maximum(above, 0)
    sums = np.cumsum(np.diff(frames) * (lost[1:] + lost[:-1]) / 2)
    late = np.flatnonzero(sums > prices.most)
    if not len(late):
        return None
    first = int(late[0])
    total = float(sums[first - 1]) if first else 0.0
    for frame in range(frames[first], frames[-1] + 1):
        total += max(excess(scene, tree, frame), 0)
        if total > prices.most:
            return frame
    return None
