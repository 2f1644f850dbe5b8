"""Pictures of the frames of an animation, in one light."""

import numpy as np

from sim.report.parts import tints
from sim.report.seen import Seen
from sim.report.shade import shade


class Painter:
    """Shades frame by frame, with what must not waver taken from the first one.

    Parameters
    ----------
    view : str
        One of sim.report.shade.VIEWS.
    lamp : (3,) float64

    Attributes
    ----------
    pictures : list of (height, width, 3) uint8
    """

    def __init__(self, view: str, lamp: np.ndarray):
        self.view, self.lamp = view, lamp
        self.pictures: list[np.ndarray] = []
        self._colours: np.ndarray | None = None
        self._depths: tuple[float, float] | None = None

    def paint(self, seen: Seen, lit: np.ndarray | None):
        """Add the picture of a frame; `lit` (height, width) is where the lamp reaches."""
        if self._colours is None:
            self._colours = tints(seen.vertices, seen.faces)
        t = seen.t[seen.hit]
        if self._depths is None and len(t):
            self._depths = float(t.min()), float(t.max())
        picture = shade(
            seen,
            self.view,
            lit=lit,
            lamp=self.lamp,
            colours=self._colours,
            depths=self._depths,
        )
        self.pictures.append(picture)
