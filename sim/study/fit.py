"""The smallest machine that a scene needs."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from amaranth.utils import bits_for

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from hdl.rays.packet import RAYS
from sim.compiler.cycles import cycles
from sim.compiler.rays import check_ray_format
from sim.divide.divided import Divided, divide
from sim.errors import InputError
from sim.model.refit import refit
from sim.parts.part import Analysis
from sim.prepare import spread, view_of
from sim.report.pixels import camera_rays
from sim.scene.camera import auto
from sim.scene.scene import Scene
from sim.study.precision.truth import against_truth

LOOKED_AT = 3
"""Frames whose images are compared."""
SPARE = 1.03
"""What fewer registers may cost in cycles of an update."""
REACHED = 0.75
"""Share of the rate of nodes and triangles that rays reach at least, memory being what it is."""
CORNER_WORDS = 4
"""Words of a triangle, one a cycle."""
ENTRY = 12
"""Cycles of the transformation unit for a packet."""
REGISTERS = (4, 8, 12, 16, 24, 32, 48, 64)


@dataclass(frozen=True)
class Tried:
    """A float format, tried on images of a scene.

    Attributes
    ----------
    wrong : float, optional
        The largest share of wrong pixels; None where it cannot be used, for a reason.
    work : list of dict
        Counters of each image: packets at nodes, packets and rays at triangles.
    """

    fmt: FloatFormat
    wrong: float | None
    reason: str = ""
    work: Sequence[dict[str, int]] = ()


def frame_cycles(prepared: Divided, tried: Tried, folded: bool, *, shadows: bool) -> float:
    """An estimate of the cycles of a frame: an update, and the image that takes most of them.

    That of the busiest unit: for nodes, for rays at triangles, for their corners, or for rays that
    enter an object. Shadows take as many rays again.
    """
    node, ray = (2, 3) if folded else (1, 1)
    image = max(
        max(
            node * of["steps"],
            ray * of["ray_tests"],
            CORNER_WORDS * of["tests"],
            ENTRY * of["entries"],
        )
        for of in tried.work
    )
    update = cycles(prepared.config, prepared.image.instructions)
    return update + (2 if shadows else 1) * image / REACHED


def narrowest(
    scene: Scene,
    analysis: Analysis,
    formats: Sequence[FloatFormat],
    error: float,
    size: tuple[int, int],
    done: Callable[[Tried], None] = lambda _: None,
) -> tuple[FloatFormat, list[Tried]]:
    """The float format of fewest bits that errs in no more pixels than `error`, and all tried ones.

    By bisection: more bits err less. By the golden model, on LOOKED_AT frames, each against float64
    on the mesh as it was given.

    Raises
    ------
    InputError
        None does.
    """
    ascending = sorted(formats, key=lambda fmt: (fmt.bits, fmt.exp_bits))
    tried: dict[int, Tried] = {}

    def serves(k: int) -> bool:
        if k not in tried:
            tried[k] = _try(scene, analysis, ascending[k], size)
            done(tried[k])
        wrong = tried[k].wrong
        return wrong is not None and wrong <= error

    low, high = 0, len(ascending)
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if serves(middle) else (middle + 1, high)
    if low == len(ascending):
        found = [each.wrong for each in tried.values() if each.wrong is not None]
        least = f"; the least is {min(found):.2g}" if found else ""
        refused = [f"; {each.fmt}: {each.reason}" for each in tried.values() if each.reason]
        raise InputError(
            f"{scene.name}: no format errs in a share of {error:g} of pixels or less{least}"
            f"{''.join(refused)}"
        )
    return ascending[low], [tried[k] for k in sorted(tried)]


def fit(
    prepared: Divided,
    size: tuple[int, int],
    *,
    camera: bool = True,
    source: bool = False,
    folded: bool = False,
) -> Config:
    """The smallest machine for a scene that is compiled for a large one of the same format.

    Units that nothing needs are left out: the update processor where nothing moves, the
    transformation unit without instances, the camera or the way of rays from memory. Stacks have
    as many levels as the trees, those that parts get anew among them; pointers and addresses the
    bits of the largest, with room for the rays and hits of an image; caches no more words than
    there are records; registers so many that fewer would cost cycles. `folded` if that is
    fast enough.
    """
    image, config = prepared.image, prepared.config
    grown = _with_all_trees(prepared)
    records = max(image.nodes, len(image.corners))
    geometry = image.nodes_at - image.vertices_at
    width, height = size
    rays = RAYS * -(-width // 2) * -(-height // 2)
    words = image.size + (3 if source else 1) * rays
    small = replace(
        config,
        update=bool(len(image.instructions)),
        instances=bool(len(image.instances)),
        camera=camera,
        source=source,
        folded=folded,
        stack_depth=max(of.levels for of in grown),
        pointer_bits=bits_for(records),
        address_bits=max(4, bits_for(words - 1)),
        cache_words=min(config.cache_words, 1 << bits_for(max(image.nodes, geometry) - 1)),
    )
    return _fewer_registers(grown, small)


def _with_all_trees(prepared: Divided) -> list[Divided]:
    """The scene with the trees that it gets from frame to frame."""
    found = [prepared]
    for frame in prepared.frames:
        if (new := found[-1].at(frame)) is not found[-1]:
            found.append(new)
    return found


def _fewer_registers(grown: list[Divided], config: Config) -> Config:
    """With as few registers as cost no more than SPARE in cycles, in each of some trees."""
    for name in ("box_registers", "vertex_registers"):
        for count in REGISTERS:
            fewer = replace(config, **{name: count})
            if all(_serves(prepared, fewer) for prepared in grown):
                config = fewer
                break
    return config


def _serves(prepared: Divided, config: Config) -> bool:
    """It compiles, to a program of hardly more cycles."""
    try:
        image = prepared.compiled(config)
    except InputError:
        return False
    fewest = cycles(prepared.config, prepared.image.instructions)
    return cycles(config, image.instructions) <= SPARE * fewest


def _try(scene: Scene, analysis: Analysis, fmt: FloatFormat, size: tuple[int, int]) -> Tried:
    try:
        check_ray_format(fmt)
        images = _images(scene, analysis, fmt, size)
        return Tried(fmt, max(wrong for wrong, _ in images), work=[work for _, work in images])
    except InputError as fault:
        return Tried(fmt, None, str(fault))


def _images(
    scene: Scene, analysis: Analysis, fmt: FloatFormat, size: tuple[int, int]
) -> list[tuple[float, dict[str, int]]]:
    """The share of wrong pixels, and the counters, of some frames."""
    config = replace(FULL, fmt=fmt, instances=True)
    prepared = divide(scene, config, frames=analysis.frames, analysis=analysis)
    poses = np.stack([prepared.scene.pose(k) for k in spread(prepared.frames, LOOKED_AT)])
    camera = auto(poses, scene.faces, *size)
    rays = camera_rays(fmt, view_of(fmt, camera))
    found = []
    for frame, pose in zip(spread(prepared.frames, LOOKED_AT), poses, strict=True):
        bits, rows = prepared.coordinates(frame), prepared.rows(frame)
        bounds = refit(fmt, prepared.image.order, bits[prepared.leaf_vertices])
        hits = prepared.trace(bits, rows, bounds, rays)
        errors = against_truth(prepared, camera, pose, rays, hits.fields(config))
        found.append((errors["wrong"], hits.counters))
    return found
