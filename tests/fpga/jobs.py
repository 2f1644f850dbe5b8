"""Jobs of a machine as its registers and memory see them, and what the model makes of them."""

import pickle
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hdl.config import Config
from hdl.core import frame_job
from hdl.records import word_bits
from hdl.registers import Access, registers
from sim.compiler.rays import HIT_FIELDS, View, hit_words, image_fields, ray_words, scene_fields
from sim.model.rays.traversal import trace
from sim.model.refit import refit
from sim.prepare import Prepared
from sim.report.passes import COUNTED
from sim.report.pixels import camera_rays


@dataclass(frozen=True)
class Run:
    """A job, the memory that it finds, and what it should leave.

    Attributes
    ----------
    name : str
    job : dict
        Values of registers by name.
    before, after : bytes
        All of memory.
    counters : dict
        Values of registers by name: those that the model has.
    regions : dict
        First and last byte, and one, of parts of the memory by name.
    """

    name: str
    job: dict[str, int]
    before: bytes
    after: bytes
    counters: dict[str, int]
    regions: dict[str, tuple[int, int]]


def job_values(config: Config, job: dict) -> dict[str, int]:
    """The values of the registers of a job, given by the fields of its layout."""
    values = {}
    for register in registers(config):
        if register.access == Access.WRITE:
            value = frame_job(config).const(job)
            for name in register.path:
                value = value[name]
            values[register.name] = value if isinstance(value, int) else value.as_bits()
    return values


def frames(
    prepared: Prepared, rays: tuple, view: View, poses: tuple[int, int, int]
) -> tuple[int, list[Run]]:
    """Bytes of memory, and three runs: an update alone, one with rays from memory, a camera.

    The first pose is that of the bounds at the start, the two that follow are updated to.
    """
    config, image = prepared.config, prepared.image
    memory = _Memory(prepared, len(rays[0]) + 4 * view.packets)
    rays_at, hits_at = image.size, image.size + 2 * len(rays[0])
    memory.words[image.nodes_at : image.size] = image.node_words(memory.bounds(poses[0]))
    memory.words[rays_at:hits_at] = ray_words(config, *rays)
    program = {"address": 0, "length": len(image.instructions)}
    from_memory = {"camera": 0, "rays": {"address": rays_at, "packets": len(rays[0]) // 4}}
    from_camera = {"camera": 1, "image": image_fields(config, view)}
    seen = camera_rays(config.fmt, view)
    columns = (np.ascontiguousarray(seen.origins), seen.directions, seen.t_min, seen.t_max)
    size = len(memory.words) * word_bits(config.fmt) // 8
    regions = {
        "program": (0, image.vertices_at),
        "vertices": (image.vertices_at, image.triangles_at),
        "nodes": (image.nodes_at, image.size),
        "rays": (rays_at, hits_at),
        "hits": (hits_at, len(memory.words)),
    }
    regions = {k: (a * image.limbs * 4, b * image.limbs * 4) for k, (a, b) in regions.items()}
    runs = []
    for name, pose, updates, casts, cast in [
        ("update", poses[1], True, {}, None),
        ("frame", poses[2], True, from_memory, rays),
        ("camera", poses[2], False, from_camera, columns),
    ]:
        memory.pose(pose)
        before = memory.words.tobytes()
        counters = {}
        if updates:
            memory.words[image.nodes_at : image.size] = image.node_words(memory.bounds(pose))
            counters["COUNT_UPDATE_INSTRUCTIONS"] = len(image.instructions)
        if cast:
            counters |= memory.cast(pose, hits_at, cast)
        job = {
            "program": program if updates else {"length": 0},
            "casts": bool(casts),
            "cast": {"scene": scene_fields(image), "hits": hits_at, **casts},
        }
        values = job_values(config, job)
        runs.append(Run(name, values, before, memory.words.tobytes(), counters, regions))
    return size, runs


class _Memory:
    """The words that should be there."""

    def __init__(self, prepared: Prepared, most: int):
        self.prepared, image = prepared, prepared.image
        rng = np.random.default_rng(1)
        size = image.size + 3 * most
        self.words = rng.integers(0, 2**32, (size, image.limbs), dtype=np.uint32)
        self.words[: image.size] = image.constant_words()

    def corners(self, pose: int) -> np.ndarray:
        return self.prepared.coordinates(pose)[self.prepared.leaf_vertices]

    def bounds(self, pose: int) -> np.ndarray:
        return refit(self.prepared.config.fmt, self.prepared.image.order, self.corners(pose))

    def pose(self, pose: int):
        image = self.prepared.image
        bits = self.prepared.coordinates(pose)
        self.words[image.vertices_at : image.triangles_at] = image.vertex_words(bits)

    def cast(self, pose: int, hits_at: int, rays: tuple) -> dict[str, int]:
        prepared = self.prepared
        config, order = prepared.config, prepared.image.order
        traced = trace(config.fmt, order, self.bounds(pose), self.corners(pose), *rays)
        columns = {field: getattr(traced, field) for field in HIT_FIELDS}
        self.words[hits_at : hits_at + len(traced.t)] = hit_words(config, columns)
        return {
            f"COUNT_CAST_{name.upper()}": traced.counters[name] for name in ("packets", *COUNTED)
        }


def write(file: Path, size: int, runs: list[Run], config: Config):
    """Runs to a file, for a process that has neither model nor compiler."""
    file.write_bytes(pickle.dumps((size, runs, config)))


def read(file: Path) -> tuple[int, list[Run], Config]:
    """The runs that `write` wrote."""
    return pickle.loads(file.read_bytes())
