"""Whether a scene fits a board: what it needs, and what there is, in numbers."""

import numpy as np

from hdl.config import Config
from hdl.rays.packet import RAYS
from hdl.records import instructions_per_word
from sim.compiler.image import Image
from sim.compiler.rays import View
from sim.errors import InputError
from sim.prepare import Prepared
from sim.scene.scene import Scene


def check_soon(scene: Scene, config: Config, words: int):
    """Refuse a scene that is too large for a memory, before it is compiled.

    It has as many nodes as triangles but one, and loads each vertex once at least.
    """
    triangles, vertices = len(scene.faces), len(np.unique(scene.faces))
    nodes = max(triangles - 1, 1)
    instructions = vertices + triangles + nodes if config.update else 0
    program = -(-instructions // instructions_per_word(config.fmt))
    _check_words(scene.name, triangles + vertices + nodes + program, words, "at least ")


def check_fit(prepared: Prepared, config: Config, words: int):
    """Refuse a scene that was compiled for a machine that a board is not, or has no room for.

    Raises
    ------
    InputError
        Names what does not fit, how much is needed and how much is there.
    """
    name, compiled = prepared.scene.name, prepared.config
    if compiled.fmt != config.fmt:
        raise InputError(
            f"{name}: is compiled for floats of {compiled.fmt} and the board's are {config.fmt}; "
            f"prepare it for the board's config"
        )
    if config.update and not compiled.update:
        raise InputError(
            f"{name}: is compiled without a program and the board updates trees by one; prepare it "
            f"for the board's config"
        )
    triangles = len(prepared.image.corners)
    if triangles > config.most_triangles:
        raise InputError(
            f"{name}: has {triangles:,} triangles and the board has indices for "
            f"{config.most_triangles:,}: pointer_bits is {config.pointer_bits} and has to be "
            f"{triangles.bit_length()}; take a smaller scene"
        )
    if compiled.instances and len(prepared.image.instances) and not config.instances:
        raise InputError(
            f"{name}: is compiled with instances and the board has none; prepare it for the "
            f"board's config"
        )
    levels = prepared.levels
    if levels > config.stack_depth:
        raise InputError(
            f"{name}: its tree has {levels} levels and a stack of the board holds "
            f"{config.stack_depth}; take a smaller scene"
        )
    for kind in ("vertex_registers", "box_registers") if config.update else ():
        needed, there = getattr(compiled, kind), getattr(config, kind)
        if needed > there:
            raise InputError(
                f"{name}: is compiled for {needed} {kind.replace('_', ' ')} and the board has "
                f"{there}; prepare it for the board's config"
            )
    _check_words(name, prepared.image.size, words)


def packets_at_once(image: Image, words: int, view: View, name: str) -> int:
    """Packets whose hits fit into a memory beside a scene: a row of the image at least.

    Raises
    ------
    InputError
        There is no room for a row.
    """
    row, free = RAYS * -(-view.width // 2), words - image.size
    if row > free:
        raise InputError(
            f"{name}: the hits of two rows of {view.width} pixels take {row:,} memory words, and "
            f"beside the scene the board has {free:,}; take a smaller --size"
        )
    return free // RAYS


def _check_words(name: str, needed: int, there: int, least: str = ""):
    if needed > there:
        raise InputError(
            f"{name}: takes {least}{needed:,} memory words and the board has {there:,}; take a "
            f"scene of fewer triangles"
        )
