"""Random worlds of triangles and instances, as a machine's test needs them: not as scenes are."""

from dataclasses import dataclass, field

import numpy as np

from hdl.config import Config
from sim.compiler.forest import Branch, compile_forest, moving_only
from sim.compiler.image import Image
from sim.model.fp.format import encode
from sim.prepare import Prepared
from sim.tree.build import build


@dataclass(frozen=True)
class Forest(Prepared):
    """Objects, and instances of them anywhere; every frame is another one at random.

    Boxes and rows have nothing to do with each other: what a machine does with them is the same.
    """

    normalised: object = None
    tree: object = None
    poses: list = field(default_factory=list)
    image: Image = None
    build_seconds: float = 0.0
    compile_seconds: float = 0.0
    corners: np.ndarray = None
    fixed: np.ndarray = None
    seed: int = 0

    @property
    def faces(self) -> np.ndarray:
        return self.corners

    def coordinates(self, frame: int) -> np.ndarray:
        rng = np.random.default_rng((self.seed, frame, 0))
        points = self.fixed.copy()
        instances = len(self.image.instances)
        centres = rng.uniform(-0.7, 0.7, (instances, 1, 3))
        ends = centres + rng.uniform(0.1, 0.6, (instances, 1, 3)) * [[-1], [1]]
        points[len(points) - 2 * instances :] = ends.reshape(-1, 3)
        return encode(self.config.fmt, points)

    def rows(self, frame: int) -> np.ndarray:
        rng = np.random.default_rng((self.seed, frame, 1))
        count = len(self.image.instances)
        turned = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
        scaled = turned * rng.choice([0.5, 1, 2, 4], (count, 1, 1))
        sheared = scaled @ (np.eye(3) + 0.5 * rng.normal(size=(count, 3, 3)))
        kind = rng.integers(5, size=(count, 1, 1))
        matrices = np.select([kind == 0, kind == 1, kind == 2], [turned, scaled, sheared], scaled)
        matrices[rng.random(count) < 0.1, 1] = 0.0  # no inverse
        offsets = rng.uniform(-0.8, 0.8, (count, 3, 1))
        return encode(self.config.fmt, np.concatenate([matrices, offsets], axis=2))


def random_forest(rng, config: Config, triangles: int = 40, instances: int = 5) -> Forest:
    """Some triangles in the world, and instances of two objects."""

    def mesh(count):
        points = rng.uniform(-0.8, 0.8, (count, 1, 3)) + rng.normal(0, 0.3, (count, 3, 3))
        return points.reshape(-1, 3), np.arange(3 * count, dtype=np.int32).reshape(-1, 3)

    parts = [mesh(triangles), mesh(triangles // 2), mesh(3)]
    starts = np.cumsum([0] + [len(points) for points, _ in parts])
    points = np.concatenate([*(points for points, _ in parts), np.zeros((2 * instances, 3))])
    boxes = rng.uniform(-1, 1, (2 * instances, 3))
    corner = starts[-1] + 2 * np.arange(instances)
    own = np.stack([corner, corner + 1, corner + 1], axis=1).astype(np.int32)
    faces = np.concatenate([parts[0][1], own])
    posed = points.copy()
    posed[starts[-1] :] = boxes
    world = Branch(build(posed, faces), faces)
    objects = [
        Branch(build(of, local), local + np.int32(begin))
        for (of, local), begin in zip(parts[1:], starts[1:], strict=False)
    ]
    placed = np.stack([triangles + np.arange(instances), rng.integers(2, size=instances)], axis=1)
    whole = compile_forest(world, objects, placed, config)
    image = moving_only(whole, np.arange(len(whole.corners)) < len(faces), regrown=False)
    corners = np.concatenate([branch.corners for branch in (world, *objects)])
    return Forest(
        tree=world.tree, image=image, corners=corners, fixed=points, seed=int(rng.integers(1 << 30))
    )
