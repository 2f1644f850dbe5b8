"""sim.model.rays.traversal with instances against all triangles of all instances, one by one."""

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from hdl.rays.packet import NO_TRIANGLE
from sim.model.fp.add import add
from sim.model.fp.format import decode, encode
from sim.model.fp.mul import mul
from sim.model.fp.order import order_key
from sim.model.rays.overflow import TRANSFORM, no_overflows
from sim.model.rays.setup import setup
from sim.model.rays.transform import transform_bits
from sim.model.rays.traversal import trace
from sim.model.rays.triangle import intersect_bits
from tests.hdl.fp.operands import weighted
from tests.hdl.rays.forests import Forest, forest, rays_at

FORMATS = {"f24": F24, "narrow": FloatFormat(5, 10)}


def into(fmt: FloatFormat, rows, origin, direction):
    """A ray in the frame of an instance, and whether a number became infinite."""
    to = np.empty((2, 3), np.int64)
    overflows = no_overflows()
    transform_bits(fmt.exp_bits, fmt.man_bits, rows, origin, direction, *to, overflows)
    return to[0], to[1], bool(overflows[TRANSFORM])


def lowest(scene: Forest, root_leaves, ray) -> tuple[int, int, int]:
    """Key of t, instance and triangle of the first hit of a ray, among all there are."""
    fmt, of = scene.fmt, scene.instances
    origin, direction, t_min, t_max = ray
    begin, end = (int(order_key(fmt, t)) for t in (t_min, t_max))
    best = end, NO_TRIANGLE, NO_TRIANGLE
    room = np.empty((3, 3), np.int64)
    world = [leaf for leaf in root_leaves[-1] if of.of_leaf[leaf] < 0]
    cases = [(NO_TRIANGLE, world, origin, direction)]
    for leaf in np.flatnonzero(of.of_leaf >= 0):
        k = of.of_leaf[leaf]
        to_origin, to_direction, _ = into(fmt, of.rows[k], origin, direction)
        cases.append((leaf, root_leaves[of.roots[k]], to_origin, to_direction))
    for instance, leaves, o, d in cases:
        row = setup(fmt, o[None], d[None])[0]
        for leaf in leaves:
            form = fmt.exp_bits, fmt.man_bits
            hit, t, _, _ = intersect_bits(*form, row, scene.corners[leaf], room, no_overflows())
            key = int(order_key(fmt, t))
            if hit and begin <= key <= end:
                best = min(best, (key, int(instance), int(leaf)))
    return best


@pytest.mark.parametrize("name", FORMATS)
def test_order_never_changes_a_hit(name, rng):
    fmt = FORMATS[name]
    hits = instances = ties = 0
    for _ in range(20):
        scene = forest(fmt, rng)
        rays = rays_at(fmt, scene, rng, 12)
        found = trace(
            fmt, scene.order, scene.bounds, scene.corners, *rays,
            margin=scene.margin, instances=scene.instances,
        )  # fmt: skip
        leaves = scene.leaves()
        for k, ray in enumerate(zip(*rays, strict=True)):
            key, instance, triangle = lowest(scene, leaves, ray)
            got = int(order_key(fmt, found.t[k])), int(found.instance[k]), int(found.triangle[k])
            if ray[2:] != (encode(fmt, np.inf), encode(fmt, -np.inf)):
                assert got == (key, instance, triangle), f"ray {k}"
                hits += triangle != NO_TRIANGLE
                instances += instance != NO_TRIANGLE
            ties += instance != NO_TRIANGLE and scene.instances.of_leaf[instance] in {3, 7}
    assert hits > 150 and 50 < instances < hits and ties > 5, (hits, instances, ties)


def test_a_margin_too_small_loses_hits(rng):
    """So that the property above can fail."""
    fmt = FORMATS["narrow"]
    lost = 0
    for _ in range(40):
        scene = forest(fmt, rng, size=3)
        rays = rays_at(fmt, scene, rng, 1000)
        enough, too_small = (
            trace(
                fmt, scene.order, scene.bounds, scene.corners, *rays,
                margin=margin, instances=scene.instances,
            )
            for margin in (scene.margin, 0)
        )  # fmt: skip
        lost += int((enough.triangle != too_small.triangle).sum())
    assert lost > 0


def test_transform_is_what_it_says(rng):
    """In numpy, an operation at a time; and within the bound of float64."""
    fmt = F24
    rows, rays = weighted(fmt, rng, 600, 4).reshape(-1, 3, 4), weighted(fmt, rng, 200, 6)
    for matrix, ray in zip(rows, rays, strict=True):
        origin, direction, _ = into(fmt, matrix, ray[:3], ray[3:])
        for got, point, last in ((origin, ray[:3], matrix[:, 3]), (direction, ray[3:], 0)):
            x, y, z = (mul(fmt, matrix[:, k], point[k]) for k in range(3))
            want = add(fmt, add(fmt, add(fmt, x, y), z), last)
            assert (got == want).all()


def test_bound_of_the_transform(rng):
    fmt, worst = F24, np.zeros(2)
    for _ in range(2000):
        matrix, ray = rng.normal(size=(3, 4)), rng.normal(size=6) * rng.choice([0.1, 1, 10])
        matrix, ray = encode(fmt, matrix), encode(fmt, ray)
        origin, direction, infinite = into(fmt, matrix, ray[:3], ray[3:])
        assert not infinite
        m, r = decode(fmt, matrix), decode(fmt, ray)
        norm, offset = np.abs(m[:, :3]).sum(axis=1).max(), np.abs(m[:, 3]).max()
        sizes = np.abs(r[:3]).max(), np.abs(r[3:]).max()
        bounds = 4 * norm * sizes[0] + offset, 3 * norm * sizes[1]
        exact = m[:, :3] @ r[:3] + m[:, 3], m[:, :3] @ r[3:]
        for k, (got, want) in enumerate(zip((origin, direction), exact, strict=True)):
            off = np.abs(decode(fmt, got) - want).max() * 2.0 ** (fmt.man_bits + 1)
            worst[k] = max(worst[k], off / bounds[k])
    assert (0.1 < worst).all() and (worst <= 1).all(), worst


def test_infinities_are_flagged():
    fmt = F24
    large, one = (encode(fmt, np.full(3, x)) for x in (2.0**62, 1.0))
    rows = encode(fmt, np.full((3, 4), 4.0))
    assert into(fmt, rows, large, one)[2] and into(fmt, rows, one, large)[2]
    assert not into(fmt, rows, one, one)[2]
