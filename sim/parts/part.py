"""A part of a scene, and how a scene is divided."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from sim.scene.scene import Scene


class Kind(StrEnum):
    """How a part moves, in the lecture's words."""

    STATIC = "static"
    STRUCTURED = "structured"
    CONTINUOUS = "continuous"
    UNSTRUCTURED = "unstructured"

    @property
    def deforms(self) -> bool:
        """Whether its bounds follow from its vertices only."""
        return self in (Kind.CONTINUOUS, Kind.UNSTRUCTURED)


@dataclass(frozen=True)
class Part:
    """Triangles that are treated alike. At rest it is as in the first frame of the analysis.

    Attributes
    ----------
    kind : Kind
    faces : (T,) int32
        Triangles of the scene, ascending. Each is in exactly one part.
    vertices : (V,) int32
        Vertices of the scene that these triangles name, ascending; no other part has them.
    pieces : int
        Connected pieces that it is made of.
    residual : float
        Largest distance of a vertex, in any frame, from an affine map of the whole part, in units
        of the normalised scene. 0 for what is static.
    transforms : (F, 3, 4) float64, optional
        Of a structured part, for each frame of the analysis: world from rest, in units of the
        scene. Invertible, with a condition of `sim.parts.motion.CONDITION` at most.
    shares : int, optional
        The part, before this one, whose geometry a structured part is in other places: triangle k
        and vertex k of the one are those of the other, and transforms are from the other's rest.
    ratio : float, optional
        Of a part that deforms: the largest SAH cost of a refitted tree over that of a new one.
    fails_from : int, optional
        Of an unstructured part: the first frame in which a tree that was built over the first
        frame costs too much.
    """

    kind: Kind
    faces: np.ndarray
    vertices: np.ndarray
    pieces: int
    residual: float = 0.0
    transforms: np.ndarray | None = None
    shares: int | None = None
    ratio: float | None = None
    fails_from: int | None = None


@dataclass(frozen=True)
class Analysis:
    """How a scene is divided.

    Attributes
    ----------
    frames : range
        That were looked at. All of them, but costs of trees are sampled.
    error : float
        Residual that a structured part may have.
    factor : float
        Ratio that a continuous part may have.
    parts : list of Part
        By their first triangles. All that is static is one part.
    """

    frames: range
    error: float
    factor: float
    parts: list[Part]


def local_faces(part: Part, faces: np.ndarray) -> np.ndarray:
    """Triangles (T, 3) int32 of a part, of those of its scene, in numbers of its own vertices."""
    return np.searchsorted(part.vertices, faces[part.faces]).astype(np.int32)


def part_scene(scene: Scene, part: Part) -> Scene:
    """A part alone."""
    faces = local_faces(part, scene.faces)
    return Scene(scene.name, faces, scene.frames, lambda frame: scene.pose(frame)[part.vertices])
