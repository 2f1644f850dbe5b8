"""Tree to memory image: the whole compiler."""

import numpy as np

from hdl.config import Config
from hdl.isa import REGISTER_BITS, VERTEX_BITS
from sim.compiler.allocate import allocate
from sim.compiler.image import Image
from sim.compiler.order import order
from sim.compiler.schedule import schedule
from sim.errors import InputError, UnfitError
from sim.tree.tree import Tree


def compile_tree(tree: Tree, faces: np.ndarray, config: Config) -> Image:
    """Image and program of a tree over a mesh, in linear time.

    Without an update processor the program is empty.

    Parameters
    ----------
    tree : Tree
    faces : (T, 3) int32
    config : Config

    Raises
    ------
    InputError
        The configuration has too few box registers, address or index bits for the scene.
    """
    if not config.update:
        # No tree needs more box registers than an instruction names.
        return place(tree, faces, config, 1 << REGISTER_BITS)
    faces = np.ascontiguousarray(faces, np.int32)
    ordered = order(tree, faces, config.box_registers)
    check_pointers(len(ordered.triangles), config)
    corners = faces[ordered.triangles]
    loads = allocate(corners, config.vertex_registers, config.lead)
    vertices, record = _records(loads.vertex)
    if len(vertices) > 1 << VERTEX_BITS:
        raise InputError(f"{len(vertices)} vertices; an instruction addresses {1 << VERTEX_BITS}")
    instructions = schedule(ordered, loads, record[loads.vertex], config)
    nodes = len(ordered.axis)
    return Image(config, ordered, instructions, vertices, record[corners], nodes)


def place(tree: Tree, faces: np.ndarray, config: Config, box_registers: int) -> Image:
    """Image of a tree without a program, in the order for one that has so many box registers."""
    faces = np.ascontiguousarray(faces, np.int32)
    ordered = order(tree, faces, box_registers)
    check_pointers(len(ordered.triangles), config)
    corners = faces[ordered.triangles]
    vertices, record = _records(corners.ravel())
    none = np.zeros(0, np.uint32)
    return Image(config, ordered, none, vertices, record[corners], len(ordered.axis))


def check_pointers(triangles: int, config: Config):
    """Refuse more triangles than the machine has indices for."""
    if triangles > config.most_triangles:
        raise UnfitError(
            f"the scene has {triangles} triangles and the configuration has indices for "
            f"{config.most_triangles}: pointer_bits is {config.pointer_bits} and has to be "
            f"{triangles.bit_length()}"
        )


def _records(uses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices in the order of their first use, and the place of each in that."""
    vertices, first = np.unique(uses, return_index=True)
    vertices = vertices[np.argsort(first)]
    record = np.empty(int(vertices.max()) + 1, np.int32)
    record[vertices] = np.arange(len(vertices))
    return vertices, record
