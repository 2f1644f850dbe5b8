"""Masses and stiff springs, integrated implicitly."""

from dataclasses import dataclass

import numpy as np
from numba import njit

TOLERANCE = 1e-3
"""Of a solution of the linear system: its residual over that of no motion."""
MOST = 2000  # iterations


@dataclass(frozen=True)
class Springs:
    """Springs between points.

    Attributes
    ----------
    ends : (S, 2) int
        Points of each spring.
    lengths : (S,) float64
        At rest, in metres.
    stiffness, damping : float
        Newtons a metre, and newtons for a metre a second along the spring.
    mass : float
        Kilograms of a point.
    free : (V,) bool
        Points that nothing holds.
    """

    ends: np.ndarray
    lengths: np.ndarray
    stiffness: float
    damping: float
    mass: float
    free: np.ndarray

    def force(self, points: np.ndarray, speeds: np.ndarray) -> np.ndarray:
        """Newtons (V, 3) that the springs put on each point."""
        length, along = self._directions(points)
        rate = (self._differences(speeds) * along).sum(axis=1)
        pull = self.stiffness * (length - self.lengths) + self.damping * rate
        return self._gathered(pull[:, np.newaxis] * along)

    def step(self, points: np.ndarray, speeds: np.ndarray, seconds: float, outer: np.ndarray):
        """Points and speeds after a step of implicit Euler; `outer` is a force, the same for all.

        (M - h dF/dv - h^2 dF/dx) dv = h (F + h dF/dx v), solved by conjugate gradients, with the
        held points filtered out. (Baraff, Witkin, "Large steps in cloth simulation", SIGGRAPH
        1998.) The matrix stays positive definite: a spring that is pressed together has no
        stiffness across itself (Choi, Ko, "Stable but responsive cloth", SIGGRAPH 2002).

        Raises
        ------
        ArithmeticError
            It does not converge.
        """
        length, along = self._directions(points)
        across = self.stiffness * np.maximum(1 - self.lengths / length, 0)
        force = self.force(points, speeds) + outer
        stiff = _stiff(self.ends, along, self.stiffness, across, speeds)
        wanted = seconds * (force - seconds * stiff) * self.free[:, np.newaxis]
        # (M + h^2 K) dv = wanted, of which the mass is divided out
        scale = seconds**2 / self.mass
        damped = scale * (self.stiffness + self.damping / seconds)
        change = _solve(
            *(self.ends, along, damped, scale * across, self.free, wanted / self.mass), MOST
        )
        if not np.isfinite(change).all():
            raise ArithmeticError(f"no solution within {MOST} iterations")
        speeds = speeds + change
        return points + seconds * speeds, speeds

    def _differences(self, of: np.ndarray) -> np.ndarray:
        return of[self.ends[:, 1]] - of[self.ends[:, 0]]

    def _directions(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        differences = self._differences(points)
        length = np.linalg.norm(differences, axis=1)
        return length, differences / length[:, np.newaxis]

    def _gathered(self, pull: np.ndarray) -> np.ndarray:
        """Sum at each point of what pulls at the first ends, and against it at the second."""
        ends, count = self.ends.T.ravel(), len(self.free)
        both = np.concatenate([pull, -pull])
        return np.stack([np.bincount(ends, both[:, k], count) for k in range(3)], axis=1)


@njit(cache=True)
def _stiff(ends, along, stiffness, across, moved):
    """The force (V, 3) against motions (V, 3), by stiffness along springs and across them."""
    force = np.zeros_like(moved)
    for spring in range(len(ends)):
        first, second = ends[spring, 0], ends[spring, 1]
        stretch = 0.0
        for k in range(3):
            stretch += (moved[second, k] - moved[first, k]) * along[spring, k]
        for k in range(3):
            stretched = stretch * along[spring, k]
            sideways = moved[second, k] - moved[first, k] - stretched
            pull = stiffness * stretched + across[spring] * sideways
            force[first, k] -= pull
            force[second, k] += pull
    return force


@njit(cache=True)
def _solve(ends, along, stiffness, across, free, wanted, most):
    """Solve x + K x = wanted where points are free, by conjugate gradients; NaN if that fails.

    (Hestenes, Stiefel 1952.)
    """
    x, residual = np.zeros_like(wanted), wanted.copy()
    direction, square = residual.copy(), (wanted * wanted).sum()
    target = TOLERANCE**2 * square
    for _ in range(most):
        if square <= target:
            return x
        product = direction + _stiff(ends, along, stiffness, across, direction)
        for point in range(len(free)):
            if not free[point]:
                product[point] = 0.0
        length = square / (direction * product).sum()
        x += length * direction
        residual -= length * product
        last, square = square, (residual * residual).sum()
        direction = residual + square / last * direction
    return np.full_like(x, np.nan)
