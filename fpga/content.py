"""From a scene to what a board is configured with."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fpga.boards.board import Board
from hdl.board import Content
from hdl.core import frame_job
from hdl.rays.packet import RAYS
from sim.compiler.rays import View, check_image, image_fields, scene_fields
from sim.errors import InputError
from sim.prepare import Prepared, prepare, view_of
from sim.scene.camera import auto
from sim.scene.load import load_scene
from sim.tree.shape import depth


@dataclass(frozen=True)
class Show:
    """A frame of a scene, seen by a camera, for a board.

    Attributes
    ----------
    prepared : Prepared
    frame : int
    view : View
    content : Content
    """

    prepared: Prepared
    frame: int
    view: View
    content: Content


def show(
    board: Board,
    scene: str,
    frame: int,
    size: tuple[int, int],
    step: Callable[[str], None] = lambda _: None,
) -> Show:
    """A frame of a scene that fits the memory of a board; `step` is told what begins.

    The vertices are those of the frame, and all bounds are zero: the update makes them.

    Raises
    ------
    InputError
        The scene or the frame is at fault, or does not fit the board.
    """
    config, (width, height) = board.config, size
    step("reading the scene")
    loaded = load_scene(scene)
    if not 0 <= frame < loaded.frames:
        raise InputError(f"--frame {frame}: {loaded.name} has frames 0 to {loaded.frames - 1}")
    check_image(config.fmt, width, height)
    rays = RAYS * -(-width // 2) * -(-height // 2)
    # As many nodes as triangles but one, and instructions and vertices: no need to compile them.
    _check_room(board, scene, 2 * len(loaded.faces) + rays, at_least=True)
    prepared = prepare(loaded, config, step=step)
    image, levels = prepared.image, depth(prepared.tree)
    _check_room(board, scene, image.size + rays)
    if levels > config.stack_depth:
        raise InputError(
            f"{scene}: its tree has {levels} levels, and a stack of {board.name} holds "
            f"{config.stack_depth}; take a smaller scene"
        )
    step("choosing the view")
    faces, pose = prepared.scene.faces, prepared.scene.pose(frame)
    view = view_of(config.fmt, auto(pose[None], faces, width, height))
    words = image.constant_words()
    words[image.vertices_at : image.triangles_at] = image.vertex_words(prepared.coordinates(frame))
    job = frame_job(config).const({
        "program": {"address": 0, "length": len(image.instructions)},
        "casts": 1,
        "cast": {
            "scene": scene_fields(image),
            "hits": image.size,
            "camera": 1,
            "image": image_fields(config, view),
        },
    })
    content = Content(as_integers(words), job.as_bits(), image.size, rays)
    return Show(prepared, frame, view, content)


def as_integers(words: np.ndarray) -> list[int]:
    """Words (n, limbs) as one integer each."""
    size, raw = words.shape[1] * 4, np.ascontiguousarray(words, "<u4").tobytes()
    return [int.from_bytes(raw[k : k + size], "little") for k in range(0, len(raw), size)]


def _check_room(board: Board, scene: str, words: int, *, at_least: bool = False):
    if words > board.words:
        needs = f"{'more than ' if at_least else ''}{words:,}"
        raise InputError(
            f"{scene}: scene and hits take {needs} words and {board.name} has {board.words:,}; "
            f"take fewer triangles or a smaller --size"
        )
