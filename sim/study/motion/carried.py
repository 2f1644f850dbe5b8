"""Bounds after many updates of one memory, against those of a memory that has seen one."""

from collections.abc import Callable

import numpy as np

from sim.model.refit import refit
from sim.model.update import execute
from sim.prepare import Prepared


def carried(prepared: Prepared, done: Callable[[int], None] = lambda _: None) -> dict:
    """Run the program on every frame in turn, on the bounds that the frame before left.

    Parameters
    ----------
    prepared : Prepared
    done : callable
        Is told each frame that is done.

    Returns
    -------
    dict
        updates; words (nodes compared, of all frames); differing (of them, those with a bound
        that has not the bits of a refit of the tree from clean memory); moved (mean share of
        vertices whose bits change from a frame to the next).
    """
    image, fmt = prepared.image, prepared.config.fmt
    bounds = np.zeros((image.nodes, 4), np.int64)
    last, moved, differing = None, [], 0
    for frame in prepared.frames:
        bits = prepared.coordinates(frame)
        bounds = execute(prepared.config, image.instructions, bits[image.vertices], bounds)
        clean = refit(fmt, image.order, bits[prepared.leaf_vertices])
        differing += int((bounds != clean).any(axis=1).sum())
        if last is not None:
            moved.append(float((bits != last).any(axis=1).mean()))
        last = bits
        done(frame)
    return {
        "updates": len(prepared.frames),
        "words": len(prepared.frames) * image.nodes,
        "differing": differing,
        "moved": float(np.mean(moved)) if moved else 0.0,
    }
