"""From a scene and a camera to what the machine runs: normalise, build, compile."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from time import perf_counter

import numpy as np

from hdl.config import Config
from hdl.fp.format import FloatFormat
from sim.compiler.check import check
from sim.compiler.compile import compile_tree
from sim.compiler.image import Image
from sim.compiler.rays import View, check_image
from sim.errors import InputError, UnfitError
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays
from sim.model.rays.setup import ROUNDING_ULPS
from sim.model.rays.transform import instances_of
from sim.model.rays.traversal import NO_TRIANGLE, Hits, trace
from sim.scene.camera import Camera
from sim.scene.normalise import Normalised, normalise
from sim.scene.scene import Scene
from sim.tree.build import POSES, build, spread
from sim.tree.shape import depth
from sim.tree.tree import Tree

COARSEST = 1 / 16
"""Farthest that rounding may move a vertex, in half sizes of the scene."""

ENOUGH = FloatFormat(4, 2)
"""The narrowest format that moves no vertex farther."""


@dataclass(frozen=True)
class Prepared:
    """A scene, compiled for a machine.

    Attributes
    ----------
    normalised : Normalised
    tree : Tree
    poses : list of int
        Frames that the tree was built over.
    image : Image
    build_seconds, compile_seconds : float
    """

    normalised: Normalised
    tree: Tree
    poses: list[int]
    image: Image
    build_seconds: float
    compile_seconds: float

    @property
    def scene(self) -> Scene:
        return self.normalised.scene

    @property
    def frames(self) -> range:
        return self.normalised.frames

    @property
    def config(self) -> Config:
        return self.image.config

    @cached_property
    def faces(self) -> np.ndarray:
        """Points (T, 3) of what the leaves are of: triangles of the scene."""
        return self.scene.faces

    @property
    def tree_faces(self) -> np.ndarray:
        """Those of them that `tree` is over: an object's are in a tree of their own."""
        return self.faces[: len(self.tree.children) + 1]

    @cached_property
    def leaf_vertices(self) -> np.ndarray:
        """Points (L, 3) that each leaf is merged from."""
        return self.faces[self.image.order.triangles]

    @property
    def advice(self) -> str:
        """What would serve the scene better; nothing if nothing would."""
        return ""

    @cached_property
    def levels(self) -> int:
        """Nodes that a packet may have waiting."""
        return depth(self.tree)

    @cached_property
    def margin(self) -> int | None:
        """Pattern of the margin of boxes, where rounding asks for a larger one than always."""
        return None

    @cached_property
    def rounding(self) -> float:
        """Half ulps of 1 + a ray's largest coordinate by which rounding moves a hit on an axis."""
        return ROUNDING_ULPS

    def rows(self, frame: int) -> np.ndarray:
        """Bit patterns (I, 3, 4) of the rows of instances in a frame."""
        return np.zeros((0, 3, 4), np.int64)

    @property
    def surface_faces(self) -> np.ndarray:
        """Vertices of the scene (S, 3) of all surfaces that rays may hit."""
        return self.leaf_vertices

    def trace(self, bits: np.ndarray, rows: np.ndarray, bounds: np.ndarray, rays: Rays) -> Hits:
        """What the model makes of rays, with patterns of points, rows and bounds (N, 4)."""
        image = self.image
        return trace(
            self.config.fmt,
            image.order,
            bounds,
            bits[self.leaf_vertices],
            rays.origins,
            rays.directions,
            rays.t_min,
            rays.t_max,
            margin=self.margin,
            instances=instances_of(image, rows),
            root=image.world - 1,
        )

    def vertices(self, bits: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """The scene's vertices (V, 3) in float64 where the machine holds them.

        Of bit patterns of points (V, 3) and of rows.
        """
        return decode(self.config.fmt, bits)

    def surfaces(self, hits: dict[str, np.ndarray]) -> np.ndarray:
        """Rows of `surface_faces` (n,) that rays hit, -1 where they hit nothing."""
        triangle = hits["triangle"]
        return np.where(triangle == NO_TRIANGLE, -1, triangle)

    def at(self, frame: int) -> "Prepared":
        """As it is to be in a frame: with other trees, where these have become too dear."""
        return self

    def points(self, frame: int) -> np.ndarray:
        """What the leaves are merged from in a frame (V, 3): the vertices of the scene."""
        return self.scene.pose(frame)

    def coordinates(self, frame: int) -> np.ndarray:
        """Bit patterns (V, 3) of the points of a frame, rounded once.

        Raises
        ------
        InputError
            The format is too narrow: names the frame and the vertex that moves too far.
        """
        exact = self.points(frame)
        bits = encode(self.config.fmt, exact)
        moved = np.abs(decode(self.config.fmt, bits) - exact).max(axis=1)
        vertex = int(moved.argmax())
        if moved[vertex] > COARSEST:
            raise InputError(
                f"{self.scene.name}: format {self.config.fmt} is too narrow: it moves vertex "
                f"{vertex} of frame {frame} by {moved[vertex]:.2g} of the scene's half size; "
                f"{ENOUGH} is enough"
            )
        return bits

    def check_updates(self, frame: int):
        """Refuse to show a frame in which vertices have moved, if the machine updates no tree."""
        if not self.config.update:
            raise UnfitError(
                f"{self.scene.name}: vertices have moved in frame {frame} and the machine has no "
                f"update processor: use a configuration with update true, or show one frame alone"
            )


def prepare(
    scene: Scene,
    config: Config,
    *,
    frames: range | None = None,
    builder: str = "sah",
    step: Callable[[str], None] = lambda _: None,
) -> Prepared:
    """Compile a scene; `step` is told what begins.

    Raises
    ------
    InputError
        The scene or a frame of it is at fault, or does not fit the machine.
    """
    step("measuring all frames")
    normalised = normalise(scene, frames)
    step("building the tree")
    chosen = spread(normalised.frames, POSES)
    poses = np.stack([normalised.scene.pose(frame) for frame in chosen])
    begin = perf_counter()
    tree = build(poses, scene.faces, builder)
    build_seconds = perf_counter() - begin
    step("compiling the program")
    begin = perf_counter()
    image = compile_tree(tree, scene.faces, config)
    compile_seconds = perf_counter() - begin
    if config.update:
        check(config, image.instructions, len(image.vertices), image.nodes)
    return Prepared(normalised, tree, chosen, image, build_seconds, compile_seconds)


def view_of(fmt: FloatFormat, camera: Camera) -> View:
    """A camera in bit patterns, each number rounded once; t from 0 to infinity.

    Raises
    ------
    InputError
        The format does not count that many columns or rows, or all pixels of one look the same way.
    """
    check_image(fmt, camera.width, camera.height)
    for step in (camera.right, camera.down):
        if not decode(fmt, encode(fmt, step)).any():
            raise InputError(
                f"format {fmt} is too narrow: a pixel's step of {np.abs(step).max():.2g} becomes "
                f"zero, below its smallest number of {2.0**fmt.min_exp:.2g}; use more exponent bits"
            )
    return View(
        origin=encode(fmt, camera.origin),
        corner=encode(fmt, camera.corner),
        right=encode(fmt, camera.right),
        down=encode(fmt, camera.down),
        width=camera.width,
        height=camera.height,
        t_min=int(encode(fmt, 0.0)),
        t_max=int(encode(fmt, np.inf)),
    )
