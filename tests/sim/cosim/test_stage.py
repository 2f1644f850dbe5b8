"""A scene on the core: no ray is lost, and nothing but the rays decides what they hit."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import FULL
from hdl.fp.format import FloatFormat
from sim.cosim.machine import Timing
from sim.cosim.stage import Stage
from sim.cosim.verilate import simulator
from sim.errors import InputError
from sim.model.fp.format import decode, encode
from sim.model.rays.camera import Rays
from sim.model.rays.traversal import NO_TRIANGLE
from sim.prepare import Prepared, prepare
from sim.report.passes import check_pass
from sim.scene.builtin.shapes import sphere
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from tests.hdl.machines import CONFIGS

FMT = FULL.fmt
pytestmark = pytest.mark.skipif(simulator() == "icarus", reason="hundreds of times slower")


def still(name: str, vertices, faces) -> Prepared:
    """A mesh at rest, prepared for the full machine."""
    return prepare(Scene(name, faces, 1, lambda _: vertices), FULL)


def aimed(targets: np.ndarray, origin: np.ndarray) -> Rays:
    """Rays (n, 3) from one point through others, padded with rays that are not there."""
    o = encode(FMT, origin)
    directions = encode(FMT, targets - decode(FMT, o))
    more = -len(directions) % 4
    directions = np.concatenate([directions, directions[:more]])
    there = np.arange(len(directions)) < len(targets)
    return Rays(
        origins=np.repeat(o[None], len(directions), axis=0),
        directions=directions,
        t_min=np.where(there, encode(FMT, 0.0), encode(FMT, np.inf)),
        t_max=np.where(there, encode(FMT, np.inf), encode(FMT, -np.inf)),
        pixels=np.full(len(directions), -1),
    )


def corners_and_edges(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """All vertices and all midpoints of edges (n, 3) of a mesh."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = np.unique(edges, axis=0)
    return np.concatenate([vertices[np.unique(faces)], vertices[edges].mean(axis=1)])


def check(stage: Stage, rays: Rays) -> np.ndarray:
    """Cast rays; hold them to model and oracle. The triangle that each hits."""
    cast = stage.cast(rays)
    found = check_pass("rays", stage, rays, cast)
    assert not found.mismatches, found.shown
    assert not found.oracle.unexplained, found.shown
    return cast.hits["triangle"]


MOVED = {
    "as it is": (1.0, 0.0),
    "moved by 1e5": (1.0, 1e5),
    "scaled by 1e-18": (1e-18, 0.0),
    "scaled by 1e18": (1e18, 0.0),
}


@pytest.mark.parametrize("moved", MOVED)
@pytest.mark.parametrize("mesh", ["sphere", "elephant.npz"])
def test_no_ray_from_inside_is_lost(mesh, moved, scene_file):
    """Rays through every vertex and the middle of every edge of a closed mesh."""
    if mesh == "sphere":
        vertices, faces = sphere(12_000)
        inside = np.array([0.3, -0.55, 0.2])
    else:
        scene = load_scene(str(scene_file(mesh)))
        vertices, faces, inside = scene.pose(0), scene.faces, None
    scale, shift = MOVED[moved]
    prepared = still(mesh, vertices * scale + shift, faces)
    if inside is None:  # the centre of the box, which is in its belly
        inside = np.zeros(3)
    else:
        inside = prepared.normalised.points(inside * scale + shift)
    with Stage(prepared, 4 * 8192, Timing()) as stage:
        targets = corners_and_edges(decode(FMT, stage.pose.bits), faces)
        assert len(targets) > 20_000
        rays = aimed(targets, inside)
        triangles = check(stage, rays)
    assert (triangles[: len(targets)] != NO_TRIANGLE).all()


def awkward(fmt: FloatFormat, vertices: np.ndarray, faces: np.ndarray, rng, count: int) -> Rays:
    """Rays along axes with zeros of both signs, from planes, vertices and triangles, that miss."""
    corners = vertices[faces]
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    some = rng.integers(0, len(faces), (4, count))
    weights = rng.dirichlet(np.ones(3), count)
    origins = np.concatenate([
        rng.uniform(low, high, (count, 3)),
        corners[some[0], 0],  # vertices
        (corners[some[1]] * weights[:, :, None]).sum(axis=1),  # inside triangles
        np.where(rng.random((count, 3)) < 0.5, corners[some[2], 1], rng.uniform(low, high)),
        rng.normal(size=(count, 3)) * 8,  # outside of the box
    ])
    directions = rng.normal(size=origins.shape)
    zero = rng.random(origins.shape) < 0.4
    directions[zero] = np.where(rng.random(zero.sum()) < 0.5, 0.0, -0.0)
    aims = rng.random(len(origins)) < 0.3  # at a vertex, on an edge
    target = corners[rng.integers(0, len(faces), len(origins)), 0]
    directions[aims] = (target - origins)[aims]
    directions[~directions.any(axis=1)] = (1.0, 0.0, -0.0)
    shuffled = rng.permutation(len(origins))
    origins, directions = origins[shuffled], directions[shuffled]
    return Rays(
        origins=encode(fmt, origins),
        directions=encode(fmt, directions),
        t_min=np.full(len(origins), encode(fmt, 0.0)),
        t_max=np.full(len(origins), encode(fmt, np.inf)),
        pixels=np.full(len(origins), -1),
    )


def reordered(rays: Rays, order: np.ndarray) -> Rays:
    """Some of the rays, in some order."""
    return Rays(
        *(getattr(rays, f)[order] for f in ("origins", "directions", "t_min", "t_max", "pixels"))
    )


def alone(fmt: FloatFormat, rays: Rays, lane: int) -> Rays:
    """Each ray as the only one of its packet that is there."""
    order = np.repeat(np.arange(len(rays.t_min)), 4)
    spread = reordered(rays, order)
    there = np.arange(len(order)) % 4 == lane
    return replace(
        spread,
        t_min=np.where(there, spread.t_min, encode(fmt, np.inf)),
        t_max=np.where(there, spread.t_max, encode(fmt, -np.inf)),
    )


def test_nothing_but_the_rays_decides_what_they_hit(rng):
    """Any order, memory, cache, stack, number of packets; a ray alone in its packet."""
    scene = load_scene("walker:500")
    runs = {
        "cached": ("tiny", Timing(4)),
        "slow": ("tiny", Timing(70, 0.2, 3)),
        "folded": ("folded", Timing(9)),
        "banks": ("banks", Timing(2)),
    }
    results = {}
    for name, (machine, timing) in runs.items():
        config = CONFIGS[machine]
        fmt = config.fmt
        prepared = prepare(scene, config)
        with Stage(prepared, 8000, timing) as stage:
            stage.show(5)
            vertices = decode(fmt, stage.pose.bits)
            rays = awkward(fmt, vertices, scene.faces, np.random.default_rng(7), 200)
            results[name] = stage.cast(rays).hits
            if name != "cached":
                continue
            check(stage, rays)
            order = rng.permutation(len(rays.t_min))
            hits = stage.cast(reordered(rays, order)).hits
            results["order"] = {k: v[np.argsort(order)] for k, v in hits.items()}
            for lane in (0, 2):
                hits = stage.cast(alone(fmt, rays, lane)).hits
                results[f"alone as {lane}"] = {k: v[lane::4] for k, v in hits.items()}
    for name, hits in results.items():
        for field, values in hits.items():
            differ = np.flatnonzero(values != results["cached"][field])
            assert not len(differ), f"{name}: {field} of ray {differ[0]} of {len(differ)}"
    hit = results["cached"]["triangle"] != NO_TRIANGLE
    assert 0.2 < hit.mean() < 0.9


def test_a_frame_that_has_not_moved_needs_no_update():
    scene = load_scene("walker:500")
    with Stage(prepare(scene, FULL), 4, Timing()) as stage:
        assert stage.show(0) is None
        moved = stage.show(3)
        assert moved and moved["update"]["instructions"] == len(stage.pose.image.instructions)
        assert (stage.machine.read(0, len(stage.pose.words)) == stage.pose.words).all()
        assert stage.show(3) is None


def test_a_memory_that_is_too_small_is_refused():
    prepared = prepare(load_scene("walker:500"), replace(FULL, address_bits=13))
    with pytest.raises(InputError, match="words"):
        Stage(prepared, 4096, Timing())
