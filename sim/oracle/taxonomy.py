"""The classes of hits that differ from the oracle's, and the rays counted by them."""

from dataclasses import dataclass

import numpy as np

CLASSES = (
    "same_bits",
    "same_triangle",
    "tie",
    "hit_became_miss",
    "miss_became_hit",
    "nearer",
    "farther",
)
"""The taxonomy of the replay of Vortex's ray tracing unit."""
NAMED = 10
"""Unexplained rays that are listed."""


@dataclass(frozen=True)
class Taxonomy:
    """Rays by class, and whether rounding explains them.

    Attributes
    ----------
    kinds : (n,) int8
        Index into CLASSES of each ray; -1 for a ray that is not there.
    counts : dict
        Rays of each of CLASSES.
    unexplained : int
        Rays that rounding does not explain.
    unexplained_rays : list of int
        The first NAMED of them.
    largest_movement : float
        Most that a ray not of same_bits takes to explain, as a share of `rounding`: above 1 if
        one is unexplained, inf if no rounding could explain it.
    largest_t_error, median_t_error : float or None
        Relative, of the rays whose triangle is the same and t not 0; None if there is none.
    """

    kinds: np.ndarray
    counts: dict[str, int]
    unexplained: int
    unexplained_rays: list[int]
    largest_movement: float
    largest_t_error: float | None
    median_t_error: float | None

    def as_dict(self) -> dict:
        """All but `kinds`, for JSON; an infinite movement is None."""
        finite = np.isfinite(self.largest_movement)
        return {
            "rays": sum(self.counts.values()),
            "counts": dict(self.counts),
            "unexplained": self.unexplained,
            "unexplained_rays": list(self.unexplained_rays),
            "largest_movement": self.largest_movement if finite else None,
            "largest_t_error": self.largest_t_error,
            "median_t_error": self.median_t_error,
        }
