"""Hits of a machine of low precision, sorted by how they differ from the oracle's."""

import numpy as np

from sim.oracle.inputs import check_rays, corners_of
from sim.oracle.movement import movements
from sim.oracle.taxonomy import CLASSES, NAMED, Taxonomy
from sim.oracle.trace import Truth


def classify(
    vertices: np.ndarray,
    faces: np.ndarray,
    origins: np.ndarray,
    directions: np.ndarray,
    t_min: np.ndarray,
    t_max: np.ndarray,
    *,
    found_t: np.ndarray,
    found_triangle: np.ndarray,
    truth: Truth,
    rounded_t: np.ndarray,
    rounding: np.ndarray,
) -> Taxonomy:
    """Compare a machine's hits with the oracle's. Mesh and rays as sim.oracle.trace takes them.

    same_bits: both miss, or the same triangle at the oracle's t, rounded. same_triangle: at
    another t. tie: another triangle, no farther along the ray than `rounding` from the oracle's
    hit. nearer and farther: another triangle, elsewhere. A hit of a ray that is not there is a
    miss that became a hit.

    Rounding explains a ray that is not of same_bits if surfaces that it moves by no more than
    `rounding` lead to its hit; sim.oracle.movement says when that is so.

    Parameters
    ----------
    found_t : (n,) float64
        Where the machine hits nothing it is not looked at.
    found_triangle : (n,) int
        Number in `faces`, -1 where it hits nothing.
    truth : Truth
        Of the same mesh and rays.
    rounded_t : (n,) float64
        truth.t, rounded once to the machine's format.
    rounding : (n,) float64
        How far the machine's rounding may move a point of a surface as each ray sees it, Euclidean
        and in the unit of the coordinates. A bound of each coordinate takes a factor of sqrt(3).
        It does not hold what underflows: in a format of few exponents a t that becomes zero moves
        a hit by up to the smallest normal times the length of the direction.

    Raises
    ------
    ValueError
        As sim.oracle.trace, or a hit names no triangle.
    """
    corners = corners_of(vertices, faces)
    origins, directions, t_min, t_max = check_rays(origins, directions, t_min, t_max)
    found_t, rounding = np.asarray(found_t, np.float64), np.asarray(rounding, np.float64)
    found = np.asarray(found_triangle, np.int64)
    for of, numbers in (("found", found), ("true", truth.triangle)):
        wrong = (numbers < -1) | (numbers >= len(corners))
        if wrong.any():
            ray = int(wrong.argmax())
            raise ValueError(
                f"{of} triangle of ray {ray}: {numbers[ray]}, of a mesh of {len(corners)}"
            )

    hit, true_hit = found >= 0, truth.triangle >= 0
    both, same = hit & true_hit, found == truth.triangle
    apart = np.full(len(found), np.inf)  # how far the hits are along the ray
    speed = np.linalg.norm(directions[both], axis=1)
    apart[both] = np.abs(found_t[both] - truth.t[both]) * speed
    kinds = np.select(
        [
            ~hit & ~true_hit | both & same & (found_t == rounded_t),
            both & same,
            both & (apart <= rounding),
            true_hit & ~hit,
            hit & ~true_hit,
            found_t < truth.t,
        ],
        range(len(CLASSES) - 1),
        len(CLASSES) - 1,
    ).astype(np.int8)
    kinds[~(t_min <= t_max) & ~hit] = -1

    differ = np.flatnonzero(kinds > 0)
    moved = movements(
        corners,
        origins[differ],
        directions[differ],
        np.stack([t_min, t_max], axis=1)[differ],
        found_t[differ],
        found[differ],
        truth.t[differ],
        truth.triangle[differ],
    )
    unexplained = differ[~(moved <= rounding[differ])]
    errors = _relative_errors(found_t, truth.t, both & same)
    return Taxonomy(
        kinds,
        {name: int((kinds == kind).sum()) for kind, name in enumerate(CLASSES)},
        len(unexplained),
        unexplained[:NAMED].tolist(),
        float((moved / rounding[differ]).max(initial=0.0)),
        float(errors.max()) if len(errors) else None,
        float(np.median(errors)) if len(errors) else None,
    )


def _relative_errors(found_t, true_t, of) -> np.ndarray:
    of = of & (true_t != 0)
    return np.abs(found_t[of] - true_t[of]) / np.abs(true_t[of])
