"""What a run of a board does to its memory, by the golden model."""

from dataclasses import dataclass

import numpy as np

from hdl import records
from hdl.config import Config
from hdl.rays.caster import COUNTERS, overflows
from sim.compiler import fields
from sim.compiler.rays import hit_words
from sim.model.rays.camera import camera
from sim.model.rays.transform import Instances
from sim.model.rays.traversal import trace
from sim.model.update import execute


@dataclass(frozen=True)
class Nodes:
    """What the model wants of sim.compiler.order.Order."""

    children: np.ndarray
    axis: np.ndarray


def run(config: Config, memory: np.ndarray, job: dict[str, int]) -> dict[str, int]:
    """Run a job on memory (words, bytes) uint8; the counters, by the names of registers."""
    words = memory.view("<u4")
    counts: dict[str, int] = {}
    if job.get("program.length"):
        _update(config, words, job)
        counts["COUNT_UPDATE_INSTRUCTIONS"] = job["program.length"]
    if job["casts"]:
        counters, infinite = _cast(config, words, job)
        counted = set(counters) & set(COUNTERS.members)  # the model counts more
        counts |= {f"COUNT_CAST_{name.upper()}": counters[name] for name in counted}
        counts |= {f"COUNT_OVERFLOWS_{name.upper()}": n for name, n in infinite.items()}
    return counts


def _vertices(config: Config, words: np.ndarray, job: dict[str, int]) -> np.ndarray:
    """What any word from the first vertex on is, taken as one."""
    layout = records.vertex(config.fmt)
    words = words[job["cast.scene.vertices"] :]
    return np.stack([fields.get(words, layout[a]) for a in "xyz"], axis=1)


def _nodes(words: np.ndarray, job: dict[str, int]) -> np.ndarray:
    begin = job["cast.scene.nodes"]
    return words[begin : begin + job["cast.scene.root"] + 1]


def _bounds(config: Config, nodes: np.ndarray) -> np.ndarray:
    return np.stack([fields.get(nodes, f) for _, f in records.bounds(config.fmt)], axis=1)


def _update(config: Config, words: np.ndarray, job: dict[str, int]):
    begin = job["program.address"]
    instructions = words[begin:].reshape(-1)[: job["program.length"]]
    nodes = _nodes(words, job)
    bounds = _bounds(config, nodes)
    bounds = execute(config, instructions, _vertices(config, words, job), bounds)
    raw = np.zeros_like(nodes)
    for column, (_, field) in enumerate(records.bounds(config.fmt)):
        fields.put(raw, field, bounds[:, column])
    size = records.bound_bytes(config.fmt)
    nodes.view(np.uint8)[:, :size] = raw.view(np.uint8)[:, :size]


def _instances(config: Config, words: np.ndarray, rows: np.ndarray, leaves: np.ndarray):
    """Of leaves that are instances, whose rows (I, 3) are words of a memory."""
    layout = records.row(config.fmt)
    held = words[rows]
    flat = held.reshape(-1, held.shape[-1])
    matrix = [fields.get(flat, layout[name]) for name in ("x", "y", "z", "offset")]
    roots = fields.get(held[:, 0], layout["root"])
    index = np.where(leaves, np.cumsum(leaves) - 1, -1)
    return Instances(index, roots, np.stack(matrix, axis=1).reshape(-1, 3, 4))


def _cast(config: Config, words: np.ndarray, job: dict[str, int]) -> tuple[dict, dict]:
    """Counters, and overflows by place."""
    root, begin = job["cast.scene.root"], job["cast.scene.nodes"]
    nodes, layout = words[begin:], records.node(config.fmt)  # objects' nodes follow the root
    axis, left_leaf, right_leaf, pointer = (
        fields.get(nodes, layout[name])
        for name in ("axis", "left_is_leaf", "right_is_leaf", "pointer")
    )
    left = np.where(left_leaf == 1, ~pointer, pointer)
    right = np.where(right_leaf == 1, ~(pointer + 1), np.arange(len(nodes)) - 1)
    if root == 0 and begin - job["cast.scene.triangles"] == 1:
        right[0] = ~pointer[0]  # one triangle, twice
    order = Nodes(np.stack([left, right], axis=1).astype(np.int32), axis.astype(np.uint8))

    triangles = words[job["cast.scene.triangles"] : begin]
    corners = np.stack([fields.get(triangles, records.TRIANGLE[v]) for v in ("v0", "v1", "v2")], 1)
    leaves = np.zeros(len(triangles), bool)
    if config.instances:
        leaves = fields.get(triangles, records.TRIANGLE["is_instance"]) == 1
    rows = job["cast.scene.vertices"] + corners[leaves]
    corners = _vertices(config, words, job)[corners]

    image = {k.removeprefix("cast.image."): v for k, v in job.items() if "image" in k}
    vectors = (
        np.array([image[f"{name}.{a}"] for a in "xyz"])
        for name in ("origin", "corner", "right", "down")
    )
    numbers = (image[name] for name in ("width", "height", "t_min", "t_max", "top"))
    assert job.get("cast.camera", config.camera)
    rays = camera(config.fmt, *vectors, *numbers)
    hits = trace(
        config.fmt,
        order,
        _bounds(config, nodes),
        corners,
        rays.origins,
        rays.directions,
        rays.t_min,
        rays.t_max,
        margin=job["cast.scene.margin"],
        instances=_instances(config, words, rows, leaves),
        root=root,
    )
    found = hit_words(config, hits.fields(config))
    words[job["cast.hits"] : job["cast.hits"] + len(found)] = found
    places = {"camera": rays.overflow, **hits.overflows}
    return hits.counters, {name: places[name] for name in overflows(config).members}
