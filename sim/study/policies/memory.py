"""What the host writes for a frame, and where it lies."""

import numpy as np

from sim.compiler.partial import corner_words
from sim.cosim.machine import Machine
from sim.prepare import Prepared
from sim.study.policies.plan import Frame


def room(prepared: Prepared) -> int:
    """Words that hold, with any tree of the scene, its image, boxes and one more program.

    An image is followed by at most two corners a node, and by a program that is no longer than the
    image's, which has at most five instructions a triangle; so has that of another tree.
    """
    words = prepared.image.size + 5 * len(prepared.image.corners)
    prepared.image.check_fits(words)
    return words


def place(machine: Machine, frame: Frame, before: Frame | None) -> int:
    """Write what a frame needs that is not there, with its vertices; the address of its program."""
    image = frame.image
    if before is None or frame.rebuilt:
        machine.write(0, image.constant_words())
    if frame.rebuilt:
        machine.write(image.nodes_at, image.node_words(frame.bounds))
    machine.write(image.vertices_at, image.vertex_words(frame.bits))
    if not frame.own_program:
        return 0
    machine.write(image.size, corner_words(frame.prepared.config.fmt, frame.boxes))
    at = image.size + len(frame.boxes)
    machine.write(at, _program_words(frame))
    return at


def words_written(frame: Frame, before: Frame | None) -> int:
    """Memory words that the host writes for an update, vertices left out: every policy has those.

    Corners and program of an update of a part; of a new tree the words of program, triangles and
    nodes that change, each of the three in a place of its own. An image that is there from the
    start costs nothing.
    """
    if frame.rebuilt:
        old = None if before is None else _sections(before)
        return sum(
            len(words) if old is None else _changed(old[part], words)
            for part, words in enumerate(_sections(frame))
        )
    return len(frame.boxes) + len(_program_words(frame)) if frame.own_program else 0


def _sections(frame: Frame) -> list[np.ndarray]:
    """Words of program, triangles and nodes."""
    image = frame.image
    words = image.constant_words()
    program, triangles = words[: image.vertices_at], words[image.triangles_at : image.nodes_at]
    return [program, triangles, image.node_words(frame.bounds)]


def _changed(old: np.ndarray, new: np.ndarray) -> int:
    """Words of a section that are others than before, or were not there."""
    both = min(len(old), len(new))
    return int((old[:both] != new[:both]).any(axis=1).sum()) + len(new) - both


def _program_words(frame: Frame) -> np.ndarray:
    limbs = frame.image.limbs
    words = np.zeros((-(-len(frame.program) // limbs), limbs), np.uint32)
    words.reshape(-1)[: len(frame.program)] = frame.program
    return words
