"""Pictures of the frames of an animation, in one light."""

import numpy as np

from sim.divide.divided import Divided
from sim.errors import InputError
from sim.prepare import Prepared
from sim.report.motion import tints_by_motion
from sim.report.parts import tints
from sim.report.seen import Seen
from sim.report.shade import VIEWS, shade

MOTION = "motion"
"""The shaded view, in colours that say how parts move."""
CHOICES = (*VIEWS, MOTION)


class Painter:
    """Shades frame by frame, with what must not waver taken from the first one.

    Parameters
    ----------
    view : str
        One of sim.report.shade.VIEWS.
    lamp : (3,) float64
    colours : (T, 3) float64, optional
        Linear ones of the triangles; else those of `parts.tints`.

    Attributes
    ----------
    pictures : list of (height, width, 3) uint8
    """

    def __init__(self, view: str, lamp: np.ndarray, colours: np.ndarray | None = None):
        self.view, self.lamp = view, lamp
        self.pictures: list[np.ndarray] = []
        self._colours = colours
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


def check_view(view: str, divided: bool):
    """Refuse one of CHOICES that a scene does not have.

    Raises
    ------
    InputError
        It is MOTION of a scene that is not divided.
    """
    if view == MOTION and not divided:
        raise InputError(f"--view {view}: shows how the parts of a scene move; with --divide")


def painter_for(view: str, prepared: Prepared, lamp: np.ndarray) -> Painter:
    """The painter of one of CHOICES."""
    if view == MOTION and isinstance(prepared, Divided):
        return Painter("shaded", lamp, tints_by_motion(prepared.analysis.parts))
    return Painter(view, lamp)
