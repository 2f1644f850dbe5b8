"""A scene of parts, compiled: a tree of the world, with instances of what moves as a whole."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter

import numpy as np

from hdl.config import Config
from sim.compiler.check import check
from sim.compiler.forest import compile_forest, moving_only
from sim.compiler.image import Image
from sim.divide.grow import Grown, join, trees_of
from sim.divide.placement import Frame, Placed, after, rows_of
from sim.model.fp.format import decode, encode
from sim.parts.analyse import analyse
from sim.parts.part import Analysis, Kind, Part
from sim.prepare import POSES, Prepared, spread
from sim.scene.normalise import normalise
from sim.scene.scene import Scene
from sim.tree.build import build
from sim.tree.cost import pose_cost
from sim.tree.shape import depth


@dataclass(frozen=True)
class Divided(Prepared):
    """A scene compiled part by part.

    Points are the scene's vertices, those of a structured part in the frame of its object, and then
    the lowest and the highest corner of each instance's box.

    Attributes
    ----------
    analysis : Analysis
        Of the normalised scene.
    grown : Grown
    moving : (V,) bool
        Vertices of the scene that move in some frame, and all of parts that get new trees.
    rigid : int
        Parts that move as a whole.
    """

    analysis: Analysis
    grown: Grown
    moving: np.ndarray
    rigid: int

    @property
    def advice(self) -> str:
        refitted = self.rigid - len(self.grown.parts)
        if not refitted:
            return ""
        return (
            f"{refitted} part{'s move' if refitted > 1 else ' moves'} as a whole and cannot be "
            f"instances in this machine: -c two-level makes them so."
        )

    def at(self, frame: int) -> "Divided":
        """With new trees of the unstructured parts to which refit has become too dear.

        It is where the SAH cost is more than the factor of the analysis above that of a new tree,
        which the host builds to know.
        """
        pose, faces = self.scene.pose(frame), self.scene.faces
        trees = {}
        for k, part in enumerate(self.analysis.parts):
            if _is_regrown(part):
                own, old = faces[part.faces], self.grown.trees[k]
                new = build(pose, own, around=pose)
                if pose_cost(old, pose, own) > self.analysis.factor * pose_cost(new, pose, own):
                    trees[k] = new
        if not trees:
            return self
        grown = join(self.scene, self.analysis, {**self.grown.trees, **trees})
        image = _compile(grown, self.moving, self.config, regrown=True)
        return replace(self, tree=grown.world.tree, image=image, grown=grown)

    @cached_property
    def levels(self) -> int:
        objects = (depth(of.tree) for of in self.grown.objects)
        return super().levels + max(objects, default=0)

    @cached_property
    def faces(self) -> np.ndarray:
        return np.concatenate([of.corners for of in (self.grown.world, *self.grown.objects)])

    def compiled(self, config: Config) -> Image:
        """The image for another machine of the same format."""
        regrown = any(map(_is_regrown, self.analysis.parts))
        return _compile(self.grown, self.moving, config, regrown=regrown)

    def points(self, frame: int) -> np.ndarray:
        points = self.scene.pose(frame)
        rest = self._rest
        for part, of in self._instances:
            points[part.vertices] = of.points(rest[part.vertices]) if part.shares is None else 0
        boxes = [decode(self.config.fmt, placed.box()) for placed in self._placed(frame)]
        return np.concatenate([points, *boxes])

    @property
    def _instances(self) -> list[tuple[Part, Frame]]:
        return list(zip(self.grown.parts, self.grown.frames, strict=True))

    @cached_property
    def _rest(self) -> np.ndarray:
        return self.scene.pose(self.analysis.frames[0])

    def rows(self, frame: int) -> np.ndarray:
        index = self.analysis.frames.index(frame)
        rows = [
            rows_of(self.config.fmt, after(part.transforms[index], of.matrix()))
            for part, of in self._instances
            if part.transforms is not None
        ]
        return np.array(rows, np.int64).reshape(-1, 3, 4)

    def _placed(self, frame: int) -> list[Placed]:
        return [
            Placed(self.config.fmt, rows, points)
            for rows, points in zip(self.rows(frame), self._object_points, strict=True)
        ]

    @cached_property
    def _object_points(self) -> list[np.ndarray]:
        """Points of each instance's object, as the machine holds them."""
        fmt, parts = self.config.fmt, self.analysis.parts
        return [
            decode(fmt, encode(fmt, of.points(self._rest[_shape(parts, part).vertices])))
            for part, of in self._instances
        ]

    @cached_property
    def rounding(self) -> float:
        placed = (each.rounding() for frame in self.frames for each in self._placed(frame))
        return max(placed, default=super().rounding)

    @cached_property
    def margin(self) -> int | None:
        """The next power of two of half ulps above `rounding`."""
        if not self.grown.parts:
            return None
        ulps = 2.0 ** np.ceil(np.log2(self.rounding))
        return int(encode(self.config.fmt, ulps * 2.0 ** -(self.config.fmt.man_bits + 1)))

    @property
    def surface_faces(self) -> np.ndarray:
        return self.scene.faces

    def vertices(self, bits: np.ndarray, rows: np.ndarray) -> np.ndarray:
        vertices = decode(self.config.fmt, bits[: len(self._rest)])
        for part, held, points in zip(self.grown.parts, rows, self._object_points, strict=True):
            vertices[part.vertices] = Placed(self.config.fmt, held, points).world
        return vertices

    def surfaces(self, hits: dict[str, np.ndarray]) -> np.ndarray:
        image = self.image
        found = super().surfaces(hits)
        triangles = self.grown.triangles[image.order.triangles[found]]
        for part, leaf in zip(self.grown.parts, image.instances.leaves.tolist(), strict=True):
            of = hits["instance"] == leaf
            shape = _shape(self.analysis.parts, part)
            triangles[of] = part.faces[np.searchsorted(shape.faces, triangles[of])]
        return np.where(found < 0, -1, triangles)


def divide(
    scene: Scene,
    config: Config,
    *,
    frames: range | None = None,
    analysis: Analysis | None = None,
    builder: str = "sah",
    step: Callable[[str], None] = lambda _: None,
) -> Divided:
    """Compile a scene part by part; the rest is as in sim.prepare.prepare.

    Still parts and parts that deform have a tree each; what moves as a whole is an instance of
    one, if the machine has instances. A tree over all these is the world's. Its program updates
    what can move.

    Parameters
    ----------
    analysis : Analysis, optional
        Of the normalised scene; made if it is not given.

    Raises
    ------
    InputError
        The scene or a frame of it is at fault, or does not fit the machine.
    """
    step("measuring all frames")
    normalised = normalise(scene, frames)
    analysis = analysis or analyse(normalised.scene, normalised.frames, step=step)
    rigid = sum(part.kind == Kind.STRUCTURED for part in analysis.parts)
    if not config.instances:
        analysis = replace(analysis, parts=[_deforming(part) for part in analysis.parts])
    scene = normalised.scene
    moving = _moving(scene, normalised.frames)
    regrown = [part for part in analysis.parts if _is_regrown(part)]
    for part in regrown:  # all of it, so that its trees have programs of like size
        moving[part.vertices] = True
    step("building the trees")
    begin = perf_counter()
    trees = trees_of(scene, analysis, builder)
    grown = join(scene, analysis, trees)
    build_seconds = perf_counter() - begin
    step("compiling the program")
    begin = perf_counter()
    image = _compile(grown, moving, config, regrown=bool(regrown))
    compile_seconds = perf_counter() - begin
    poses = spread(normalised.frames, POSES)
    tree = grown.world.tree
    seconds = build_seconds, compile_seconds
    return Divided(normalised, tree, poses, image, *seconds, analysis, grown, moving, rigid)


def _moving(scene: Scene, frames: range) -> np.ndarray:
    """Vertices (V,) that move in some frame."""
    first = scene.pose(frames[0])
    moving = np.zeros(len(first), np.bool_)
    for frame in frames:
        moving |= (scene.pose(frame) != first).any(axis=1)
    return moving


def _compile(grown: Grown, moving: np.ndarray, config: Config, *, regrown: bool) -> Image:
    """Image of all trees; its program updates the leaves of which a point moves in some frame."""
    whole = compile_forest(grown.world, grown.objects, grown.instances, config)
    points = np.concatenate([moving, np.ones(2 * len(grown.parts), np.bool_)])
    moves = points[grown.world.corners].any(axis=1)
    still = [np.zeros(len(branch.corners), np.bool_) for branch in grown.objects]
    moves = np.concatenate([moves, *still])[whole.order.triangles]
    image = moving_only(whole, moves, regrown=regrown)
    check(config, image.instructions, image.records, image.world, complete=False)
    return image


def _is_regrown(part: Part) -> bool:
    """It gets new trees, as frames go by."""
    return part.kind == Kind.UNSTRUCTURED


def _deforming(part: Part) -> Part:
    """A part as it is to a machine without instances."""
    if part.kind != Kind.STRUCTURED:
        return part
    return replace(part, kind=Kind.CONTINUOUS, transforms=None, shares=None)


def _shape(parts: Sequence[Part], part: Part) -> Part:
    """The part whose geometry a structured part has."""
    return part if part.shares is None else parts[part.shares]
