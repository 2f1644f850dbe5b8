"""Tree to memory image: the whole compiler."""

import numpy as np

from hdl.config import Config
from hdl.isa import VERTEX_BITS
from sim.compiler.allocate import allocate
from sim.compiler.image import Image
from sim.compiler.order import order
from sim.compiler.schedule import schedule
from sim.errors import InputError
from sim.tree.tree import Tree


def compile_tree(tree: Tree, faces: np.ndarray, config: Config) -> Image:
    """Image and program of a tree over a mesh, in linear time.

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
    faces = np.ascontiguousarray(faces, np.int32)
    ordered = order(tree, faces, config.box_registers)
    corners = faces[ordered.triangles]
    loads = allocate(corners, config.vertex_registers, config.lead)

    # Vertices in the order of their first load.
    vertices, first = np.unique(loads.vertex, return_index=True)
    vertices = vertices[np.argsort(first)]
    if len(vertices) > 1 << VERTEX_BITS:
        raise InputError(f"{len(vertices)} vertices; an instruction addresses {1 << VERTEX_BITS}")
    record = np.empty(int(corners.max()) + 1, np.int32)
    record[vertices] = np.arange(len(vertices))

    instructions = schedule(ordered, loads, record[loads.vertex], config)
    return Image(config, ordered, instructions, vertices, record[corners])
