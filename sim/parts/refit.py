"""Whether one tree serves a part that deforms, and from when on not."""

import numpy as np

from sim.scene.scene import Scene
from sim.tree.build import POSES, build, spread
from sim.tree.rebuild import first_above, rebuilt_cost, refitted_cost
from sim.tree.tree import Tree

SAMPLES = 8
"""Frames at which a refitted tree is compared with a new one, and the last one."""


def refit_ratio(scene: Scene, frames: range, factor: float) -> tuple[float, int | None]:
    """How much a refitted tree costs in its worst frame, by how much a new one does.

    Two trees are tried: the one of sim.prepare, over poses of the whole animation, and one over
    the first frame, which knows nothing of what comes. The better of the two says whether refit
    serves. Where it does not, a machine begins with the second and has to replace it in time.

    Parameters
    ----------
    scene : Scene
    frames : range
    factor : float

    Returns
    -------
    ratio : float
        Of SAH costs, of the better tree: the largest in SAMPLES frames and the last.
    fails_from : int or None
        If that is above `factor`: the first frame in which the second tree is above it too.
    """
    samples = sorted({*spread(frames, SAMPLES), frames[-1]})
    poses = np.stack([scene.pose(frame) for frame in spread(frames, POSES)])
    first = build(scene.pose(frames[0]), scene.faces)
    rebuilt = [rebuilt_cost(scene, frame) for frame in samples]

    def ratios(tree: Tree) -> list[float]:
        costs = [refitted_cost(scene, tree, frame) for frame in samples]
        return [cost / new for cost, new in zip(costs, rebuilt, strict=True)]

    late = ratios(first)
    ratio = min(max(late), max(ratios(build(poses, scene.faces))))
    if ratio <= factor:
        return ratio, None
    return ratio, first_above(
        samples,
        late,
        lambda frame: refitted_cost(scene, first, frame) / rebuilt_cost(scene, frame),
        factor,
    )
