"""What a policy does in each frame: what is run and written, and how old the bounds are."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hdl.fp.format import FloatFormat
from sim.compiler.compile import compile_tree
from sim.compiler.image import Image
from sim.compiler.partial import partial
from sim.model.fp.format import decode
from sim.model.refit import box_corners, refit
from sim.prepare import Prepared
from sim.study.policies.policy import parse
from sim.tree.build import build
from sim.tree.cost import pose_cost

NOTHING = np.zeros(0, np.uint32)
NO_BOXES = np.zeros((0, 3), np.int64)


@dataclass(frozen=True)
class Frame:
    """A frame under a policy.

    Attributes
    ----------
    frame : int
    prepared : Prepared
        With the tree and the image of now.
    bits : (V, 3) int64 patterns
        Vertices of the scene.
    bounds : (N, 4) int64 patterns
        What the bounds of all nodes are after the update.
    rebuilt : bool
        The host writes the image, bounds among it.
    program : (n,) uint32
        What is run: the image's, one of its own, or nothing.
    boxes : (2K, 3) int64 patterns
        Corners that the program takes from behind the image.
    growth : float
        By how much boxes have to be larger on each side to hold their triangles: the largest
        distance, on an axis, of a vertex from where it was when the bounds were made. Rounded up.
    """

    frame: int
    prepared: Prepared
    bits: np.ndarray
    bounds: np.ndarray
    rebuilt: bool
    program: np.ndarray
    boxes: np.ndarray
    growth: float

    @property
    def image(self) -> Image:
        return self.prepared.image

    @property
    def own_program(self) -> bool:
        """The program is not that of the image: the host writes it too."""
        return bool(len(self.program)) and self.program is not self.image.instructions


def plan(prepared: Prepared, policy: str, frames: Sequence[int]) -> Iterator[Frame]:
    """The frames, in their order, under a policy of sim.study.policies. Exact, and no Verilog.

    Raises
    ------
    InputError
        There is no such policy, the format is too narrow for a frame, or the machine too small for
        a new tree.
    """
    kind, number = parse(policy)
    rebuilds = kind in ("rebuild", "sah")
    yield from (_rebuilding if rebuilds else _refitting)(prepared, kind, number, frames)


def _rebuilding(
    prepared: Prepared, kind: str, number: float, frames: Sequence[int]
) -> Iterator[Frame]:
    cost = 0.0  # of the tree when it was new
    for count, frame in enumerate(frames):
        if kind == "rebuild":
            due = count % number == 0
        else:
            due = count == 0 or _cost(prepared, frame) > number * cost
        if due:
            prepared = _rebuild(prepared, frame)
            cost = _cost(prepared, frame)
        bits, image = prepared.coordinates(frame), prepared.image
        bounds = refit(prepared.config.fmt, image.order, bits[prepared.leaf_vertices])
        program = NOTHING if due else image.instructions
        yield Frame(frame, prepared, bits, bounds, due, program, NO_BOXES, 0.0)


def _refitting(
    prepared: Prepared, kind: str, number: float, frames: Sequence[int]
) -> Iterator[Frame]:
    fmt, image = prepared.config.fmt, prepared.image
    made = None  # patterns (L, 3, 3) of the leaves' corners that the bounds are made of
    for count, frame in enumerate(frames):
        bits = prepared.coordinates(frame)
        now = bits[prepared.leaf_vertices]
        program, boxes = NOTHING, NO_BOXES
        if made is None or (kind != "moved" and count % number == 0):
            program, made = image.instructions, now
        elif kind == "moved":
            moved = _distance(fmt, now, made).max(axis=(1, 2)) > number
            program, boxes, made = _part(image, moved, now, made)
        growth = 0.0 if kind == "stale" else float(_distance(fmt, now, made).max())
        bounds = refit(fmt, image.order, made)
        yield Frame(frame, prepared, bits, bounds, False, program, boxes, growth)


def _part(image: Image, moved: np.ndarray, now: np.ndarray, made: np.ndarray):
    """Program and boxes for the leaves that moved, and the corners of which bounds are made then.

    For all leaves, where that takes less together with what the host would write, a word a cycle.
    """
    part = partial(image, moved)
    words = 2 * len(part.spans) + -(-len(part.instructions) // image.limbs)
    if len(part.instructions) + words >= len(image.instructions):
        return image.instructions, NO_BOXES, now
    boxes = box_corners(image.config.fmt, made, part.spans)
    return part.instructions, boxes, np.where(part.merged[:, None, None], now, made)


def _distance(fmt: FloatFormat, now: np.ndarray, then: np.ndarray) -> np.ndarray:
    """How far numbers lie apart, of bit patterns: float64, rounded up."""
    distance = np.abs(decode(fmt, now) - decode(fmt, then))
    return np.where(distance > 0, np.nextafter(distance, np.inf), 0.0)


def _cost(prepared: Prepared, frame: int) -> float:
    return pose_cost(prepared.tree, prepared.scene.pose(frame), prepared.scene.faces)


def _rebuild(prepared: Prepared, frame: int) -> Prepared:
    """The scene with a tree that is built over one pose."""
    tree = build(prepared.scene.pose(frame), prepared.scene.faces)
    image = compile_tree(tree, prepared.scene.faces, prepared.config)
    return replace(prepared, tree=tree, poses=[frame], image=image)
