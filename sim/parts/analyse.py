"""Dividing a scene into parts by how they move."""

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from sim.parts.follow import Followed, follow
from sim.parts.part import Analysis, Kind, Part, part_scene
from sim.parts.refit import refit_ratio
from sim.parts.shared import sharing
from sim.parts.sort import sort_pieces
from sim.scene.normalise import Normalised, normalise
from sim.scene.scene import Scene

ERROR = 2.0**-18
"""Residual of a structured part, in units of the normalised scene: half an ulp of F24 below 1, by
which rounding moves a vertex there anyway."""
FACTOR = 2.0
"""SAH cost of a refitted tree over that of a new one, of a continuous part."""
POSES_KEPT = 16
"""Of the scene: those that all parts are compared in."""


def analyse(
    scene: Scene,
    frames: range | None = None,
    error: float = ERROR,
    factor: float = FACTOR,
    step: Callable[[str], None] = lambda _: None,
) -> Analysis:
    """Sort the parts of a scene by how they move.

    What hangs together is a piece: by common vertices, or by vertices that coincide in all frames.

    - All pieces of which no vertex moves are the static part.
    - Pieces that follow one affine map in all frames are a structured part, if they have enough
      vertices for a map to mean something (`sim.parts.common.LEAST`).
    - Others deform. Those that stay adjacent are one part; it is continuous if one tree can be
      refitted to all frames, else unstructured. All that is continuous is in one tree: where that
      cannot be refitted, since they move apart, they are one unstructured part.

    Takes about linear time, and a pass over all frames for each of a few steps.

    Parameters
    ----------
    scene : Scene
    frames : range, optional
        Ascending, one by one; all, if not given. The first one is where parts are at rest.
    error : float
        Residual that a structured part may have, in units of the normalised scene.
    factor : float
        Ratio of SAH costs that a continuous part may have.
    step : callable
        Told what begins.

    Raises
    ------
    InputError
        The scene has no such frames, or a vertex that is not finite.
    ValueError
        The error is below 0, or the factor below 1.
    """
    if not 0 <= error < np.inf:
        raise ValueError(f"an error of {error:g} is none: give 0 or more, of the scene's half size")
    if not 1 <= factor < np.inf:
        raise ValueError(f"a factor of {factor:g} is none: a new tree costs 1, give that or more")
    step("measuring all frames")
    normalised = normalise(scene, frames)
    frames = normalised.frames
    pose = lru_cache(POSES_KEPT)(normalised.scene.pose)
    unit = Scene(scene.name, scene.faces, scene.frames, pose)
    parts = sort_pieces(unit, frames, error, step)
    step("fitting maps")
    parts = _fitted(parts, unit, frames, error)
    step("comparing trees")
    parts = [_judged(part, unit, frames, factor) for part in parts]
    parts = _together(parts, unit, frames, error, factor)
    step("finding copies")
    parts = _shared(parts, unit, frames, error)
    return Analysis(frames, error, factor, [_in_source(part, normalised) for part in parts])


def _fitted(parts: list[Part], scene: Scene, frames: range, error: float) -> list[Part]:
    """With the residuals of all that moves, and the maps of what is structured."""
    fitted = list(parts)
    moving = [k for k, part in enumerate(parts) if part.kind is not Kind.STATIC]
    if moving:
        vertices = [parts[k].vertices for k in moving]
        followed = _follow(scene, frames, vertices, vertices, error)
        for k, maps, residual in zip(moving, followed.maps, followed.residual, strict=True):
            structured = parts[k].kind is Kind.STRUCTURED
            transforms = maps if structured else None
            fitted[k] = replace(parts[k], residual=float(residual), transforms=transforms)
    return fitted


def _shared(parts: list[Part], scene: Scene, frames: range, error: float) -> list[Part]:
    """With the maps from another part's rest, of those that have the geometry of another."""
    shared = list(parts)
    chosen = [k for k, part in enumerate(parts) if part.kind is Kind.STRUCTURED]
    found = sharing(parts, chosen, scene.faces, scene.pose(frames[0]), error)
    if found:
        vertices = [parts[k].vertices for k in found]
        others = [parts[first].vertices for first in found.values()]
        followed = _follow(scene, frames, vertices, others, error)
        for row, (k, first) in enumerate(found.items()):
            if followed.holds(error)[row]:
                maps, residual = followed.maps[row], float(followed.residual[row])
                shared[k] = replace(parts[k], residual=residual, transforms=maps, shares=first)
    return shared


def _follow(
    scene: Scene,
    frames: range,
    vertices: list[np.ndarray],
    others: list[np.ndarray],
    error: float,
) -> Followed:
    """Fit vertices of some parts to where others, vertex by vertex, are at rest."""
    starts = np.cumsum([0] + [len(some) for some in vertices[:-1]])
    rest = scene.pose(frames[0])[np.concatenate(others)]
    return follow(scene.pose, frames, np.concatenate(vertices), rest, starts, error)


def _judged(part: Part, scene: Scene, frames: range, factor: float) -> Part:
    """With what refit costs a part that deforms, and so its kind."""
    if part.kind is not Kind.CONTINUOUS:
        return part
    ratio, fails_from = refit_ratio(part_scene(scene, part), frames, factor)
    kind = Kind.CONTINUOUS if ratio <= factor else Kind.UNSTRUCTURED
    return replace(part, kind=kind, ratio=ratio, fails_from=fails_from)


def _together(
    parts: list[Part], scene: Scene, frames: range, error: float, factor: float
) -> list[Part]:
    """With one unstructured part of all continuous ones, if one tree does not serve them all."""
    bending = [part for part in parts if part.kind is Kind.CONTINUOUS]
    if len(bending) < 2:
        return parts
    whole = Part(
        Kind.CONTINUOUS,
        np.sort(np.concatenate([part.faces for part in bending])),
        np.sort(np.concatenate([part.vertices for part in bending])),
        sum(part.pieces for part in bending),
    )
    whole = _judged(_fitted([whole], scene, frames, error)[0], scene, frames, factor)
    if whole.kind is Kind.CONTINUOUS:
        return parts
    others = [part for part in parts if part.kind is not Kind.CONTINUOUS]
    return sorted([*others, whole], key=lambda part: part.faces[0])


def _in_source(part: Part, normalised: Normalised) -> Part:
    """With transforms in units of the scene."""
    if part.transforms is None:
        return part
    maps, centre = part.transforms.copy(), normalised.centre
    maps[:, :, 3] = np.ldexp(maps[:, :, 3], normalised.exponent) + centre - maps[:, :, :3] @ centre
    return replace(part, transforms=maps)
