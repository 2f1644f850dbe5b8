"""What a run of a board does to its memory, by the golden model."""

from dataclasses import dataclass

import numpy as np

from hdl import records
from hdl.config import Config
from sim.compiler import fields
from sim.compiler.rays import HIT_FIELDS, hit_words
from sim.model.rays.camera import camera
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
    if job["program.length"]:
        _update(config, words, job)
        counts["COUNT_UPDATE_INSTRUCTIONS"] = job["program.length"]
    if job["casts"]:
        counters, overflows = _cast(config, words, job)
        counts |= {f"COUNT_CAST_{name.upper()}": n for name, n in counters.items()}
        counts |= {f"COUNT_OVERFLOWS_{name.upper()}": n for name, n in overflows.items()}
        for name in ("DEEPEST", "ENTRIES"):  # there is no such register
            counts.pop(f"COUNT_CAST_{name}")
    return counts


def _vertices(config: Config, words: np.ndarray, job: dict[str, int]) -> np.ndarray:
    layout = records.vertex(config.fmt)
    begin, end = job["cast.scene.vertices"], job["cast.scene.triangles"]
    return np.stack([fields.get(words[begin:end], layout[a]) for a in "xyz"], axis=1)


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


def _cast(config: Config, words: np.ndarray, job: dict[str, int]) -> tuple[dict, dict]:
    """Counters, and overflows by place."""
    nodes, layout = _nodes(words, job), records.node(config.fmt)
    axis, left_leaf, right_leaf, pointer = (
        fields.get(nodes, layout[name])
        for name in ("axis", "left_is_leaf", "right_is_leaf", "pointer")
    )
    left = np.where(left_leaf == 1, ~pointer, pointer)
    right = np.where(right_leaf == 1, ~(pointer + 1), np.arange(len(nodes)) - 1)
    if len(nodes) == 1 and job["cast.scene.nodes"] - job["cast.scene.triangles"] == 1:
        right[0] = ~pointer[0]  # one triangle, twice
    order = Nodes(np.stack([left, right], axis=1).astype(np.int32), axis.astype(np.uint8))

    triangles = words[job["cast.scene.triangles"] : job["cast.scene.nodes"]]
    corners = np.stack([fields.get(triangles, records.TRIANGLE[v]) for v in ("v0", "v1", "v2")], 1)
    corners = _vertices(config, words, job)[corners]

    image = {k.removeprefix("cast.image."): v for k, v in job.items() if "image" in k}
    vectors = (
        np.array([image[f"{name}.{a}"] for a in "xyz"])
        for name in ("origin", "corner", "right", "down")
    )
    numbers = (image[name] for name in ("width", "height", "t_min", "t_max", "top"))
    assert job["cast.camera"]
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
    )
    found = hit_words(config, {name: getattr(hits, name) for name in HIT_FIELDS})
    words[job["cast.hits"] : job["cast.hits"] + len(found)] = found
    return hits.counters, {"camera": rays.overflow, **hits.overflows}
