"""Rays of a run in a file, with the mesh and the tree that they met."""

from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from hdl.config import Config
from hdl.fp.format import FloatFormat
from sim.compiler.compile import compile_tree
from sim.compiler.rays import HIT_FIELDS
from sim.cosim.stage import Cast, Stage
from sim.errors import InputError
from sim.files import written_whole
from sim.model.fp.format import decode
from sim.model.rays.camera import Rays
from sim.model.rays.traversal import NO_TRIANGLE
from sim.prepare import Prepared
from sim.scene.normalise import Normalised
from sim.scene.scene import Scene
from sim.tree.shape import check
from sim.tree.tree import Tree

RAY_FIELDS = ("origins", "directions", "t_min", "t_max")
VERSION = 2


class Recorder:
    """Keeps the rays of a run, pass by pass, all through one pose of a scene."""

    def __init__(self):
        self._stage: Stage | None = None
        self._passes: list[dict[str, np.ndarray]] = []

    def add(self, stage: Stage, rays: Rays, cast: Cast):
        """Keep rays and the hits that the Verilog found."""
        self._stage = stage
        self._passes.append({k: getattr(rays, k) for k in RAY_FIELDS} | cast.hits)

    def save(self, file: Path):
        """Write all that was kept, whole or not at all."""
        if self._stage is None:
            raise ValueError("nothing was recorded")
        prepared = self._stage.pose.prepared
        columns = {
            name: np.concatenate([p[name] for p in self._passes])
            for name in (*RAY_FIELDS, *HIT_FIELDS)
        }
        columns |= by_scene(prepared, columns)
        columns = {name: column.astype(np.uint32) for name, column in columns.items()}
        fmt = prepared.config.fmt
        arrays = {
            "version": np.array(VERSION),
            "name": np.array(prepared.scene.name),
            "format": np.array([fmt.exp_bits, fmt.man_bits]),
            "faces": prepared.scene.faces,
            "bits": self._stage.pose.bits.astype(np.uint32),
            "children": prepared.tree.children,
            "axis": prepared.tree.axis,
        }
        with written_whole(file) as temporary:
            np.savez_compressed(temporary, allow_pickle=False, **(arrays | columns))


@dataclass(frozen=True)
class Recording:
    """What a file holds.

    Attributes
    ----------
    name : str
        Of the scene.
    fmt : FloatFormat
    faces : (T, 3) int32
    bits : (V, 3) int64
        Vertices in bit patterns.
    tree : Tree
    rays : Rays
    hits : dict of (n,) int64
        As the Verilog found them then, `by_scene`.
    """

    name: str
    fmt: FloatFormat
    faces: np.ndarray
    bits: np.ndarray
    tree: Tree
    rays: Rays
    hits: dict[str, np.ndarray]

    def prepare(self, config: Config) -> Prepared:
        """The scene as it was, for a machine of the same format."""
        pose = decode(self.fmt, self.bits)
        scene = Scene(self.name, self.faces, 1, lambda _: pose)
        image = compile_tree(self.tree, self.faces, config)
        as_it_is = Normalised(scene, range(1), np.zeros(3), 0)
        return Prepared(as_it_is, self.tree, [0], image, 0.0, 0.0)


def by_scene(prepared: Prepared, hits: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The fields of hits, with triangles of the scene: the order of the leaves is the machine's."""
    found = {name: hits[name] for name in HIT_FIELDS}
    leaf = found["triangle"]
    hit = leaf != NO_TRIANGLE
    found["triangle"] = np.full_like(leaf, NO_TRIANGLE)
    found["triangle"][hit] = prepared.image.order.triangles[leaf[hit]]
    return found


def load(file: Path) -> Recording:
    """Read a recording.

    Raises
    ------
    InputError
        There is no such file, or it is no recording that is whole.
    """
    if not file.exists():
        raise InputError(f"{file}: no such file; record one with bkd-sim render --record {file}")
    try:
        with file.open("rb") as stream, np.load(stream) as stored:
            if int(stored["version"]) != VERSION:
                raise InputError(f"{file}: recorded by another version; record it again")
            columns = {name: stored[name].astype(np.int64) for name in (*RAY_FIELDS, *HIT_FIELDS)}
            fmt = FloatFormat(*stored["format"].tolist())
            tree = Tree(stored["children"], stored["axis"])
            faces, bits = stored["faces"], stored["bits"].astype(np.int64)
            name = str(stored["name"])
        check(tree, len(faces))
        count = len(columns["t"])
        shapes = [columns[name].shape for name in (*RAY_FIELDS, *HIT_FIELDS)]
        if shapes != [(count, 3)] * 2 + [(count,)] * 6 or count % 4 or not count:
            raise ValueError("its rays are no whole packets")
        if faces.max(initial=0) >= len(bits) or faces.min(initial=0) < 0:
            raise ValueError("a face names no vertex")
        if max(int(columns[k].max()) for k in (*RAY_FIELDS, *HIT_FIELDS[:3])) >> fmt.bits:
            raise ValueError(f"its numbers are not of format {fmt}")
    except (OSError, ValueError, KeyError, TypeError, BadZipFile, EOFError) as error:
        raise InputError(f"{file}: no whole recording of bkd-sim render ({error})") from error
    rays = Rays(*(columns[name] for name in RAY_FIELDS), pixels=np.full(count, -1))
    return Recording(name, fmt, faces, bits, tree, rays, {k: columns[k] for k in HIT_FIELDS})
