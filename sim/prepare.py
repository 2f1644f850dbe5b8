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
from sim.errors import InputError
from sim.model.fp.format import decode, encode
from sim.scene.camera import Camera
from sim.scene.normalise import Normalised, normalise
from sim.scene.scene import Scene
from sim.tree.build import build
from sim.tree.tree import Tree

COARSEST = 1 / 16
"""Farthest that rounding may move a vertex, in half sizes of the scene."""

ENOUGH = FloatFormat(4, 2)
"""The narrowest format that moves no vertex farther."""

POSES = 3
"""Poses that a tree is built over."""


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
    def leaf_vertices(self) -> np.ndarray:
        """Vertices of the scene (L, 3) of each leaf."""
        return self.scene.faces[self.image.order.triangles]

    def coordinates(self, frame: int) -> np.ndarray:
        """Bit patterns (V, 3) of the vertices of a frame, rounded once.

        Raises
        ------
        InputError
            The format is too narrow: names the frame and the vertex that moves too far.
        """
        exact = self.scene.pose(frame)
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
            raise InputError(
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


def spread(frames: range, most: int) -> list[int]:
    """Some of many frames: the first one, and others at even distances."""
    count = min(len(frames), most)
    return [frames[k * len(frames) // count] for k in range(count)]


def view_of(fmt: FloatFormat, camera: Camera) -> View:
    """A camera in bit patterns, each number rounded once; t from 0 to infinity.

    Raises
    ------
    InputError
        The format does not count that many columns or rows.
    """
    check_image(fmt, camera.width, camera.height)
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
