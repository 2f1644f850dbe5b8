"""sim.divide.placement: matrices, boxes, and a bound of what rounding does."""

from fractions import Fraction

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from sim.divide.placement import Placed, after, frame_of, rows_of
from sim.model.fp.format import decode, encode
from sim.model.rays.setup import ROUNDING_ULPS
from sim.model.rays.transform import transform

FORMATS = [F24, FloatFormat(6, 9)]


def placements(rng, count: int) -> np.ndarray:
    """Rigid, scaled and sheared maps (count, 3, 4) from an object's frame into [-1, 1]."""
    turned = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    shear = np.eye(3) + 0.3 * rng.normal(size=(count, 3, 3)) * (rng.random((count, 1, 1)) < 0.3)
    scale = 2.0 ** rng.uniform(-6, 0, (count, 1, 1))
    return np.concatenate([turned @ shear * scale, rng.uniform(-0.5, 0.5, (count, 3, 1))], axis=2)


def test_a_frame_holds_its_object(rng):
    for scale in (1e-6, 0.3, 5.0):
        rest = rng.normal(size=(50, 3)) * scale + rng.normal(size=3)
        frame = frame_of(rest)
        points = frame.points(rest)
        assert 0.49 < np.abs(points).max() <= 1
        back = points @ frame.matrix()[:, :3].T + frame.matrix()[:, 3]
        assert np.allclose(back, rest, rtol=0, atol=1e-15)
    assert frame_of(np.ones((3, 3))).points(np.ones((3, 3))).tolist() == [[0.0] * 3] * 3


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_boxes_hold_what_is_in_them_and_are_tight(fmt, rng):
    points = decode(fmt, encode(fmt, rng.uniform(-1, 1, (40, 3))))
    for placement in placements(rng, 50):
        placed = Placed(fmt, rows_of(fmt, placement), points)
        low, high = decode(fmt, placed.box())
        assert (low <= placed.world.min(axis=0)).all() and (high >= placed.world.max(axis=0)).all()
        exact = points @ placement[:, :3].T + placement[:, 3]
        near = 8 * 2.0**-fmt.man_bits * (1 + np.abs(np.linalg.inv(placement[:, :3])).sum())
        assert np.abs(placed.world - exact).max() < near
        assert np.abs(np.stack([low, high]) - [exact.min(0), exact.max(0)]).max() < near


def test_one_after_another(rng):
    first, second = placements(rng, 2)
    point = rng.normal(size=3)
    once = first[:, :3] @ (second[:, :3] @ point + second[:, 3]) + first[:, 3]
    both = after(first, second)
    assert np.allclose(both[:, :3] @ point + both[:, 3], once)


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_rays_are_off_by_less_than_the_bound(fmt, rng):
    """The point of a ray that the model transforms, against exact arithmetic, in the world."""
    unit = 2.0 ** -(fmt.man_bits + 1)
    points = np.zeros((1, 3))
    worst = 0.0
    for placement in placements(rng, 200):
        rows = rows_of(fmt, placement)
        origin = encode(fmt, rng.uniform(-3, 3, 3))
        reach = 1 + np.abs(decode(fmt, origin)).max()
        direction = encode(fmt, rng.normal(size=3))
        t = rng.uniform(0, 1) * (reach / np.abs(decode(fmt, direction)).max())
        seen = transform(fmt, rows, origin[None], direction[None])
        exact = [[Fraction(float(x)) for x in row] for row in decode(fmt, rows)]
        off = []
        for k in range(3):
            point = Fraction(float(decode(fmt, seen[0][0, k])))
            point += Fraction(t) * Fraction(float(decode(fmt, seen[1][0, k])))
            for a in range(3):
                world = Fraction(float(decode(fmt, origin[a])))
                world += Fraction(t) * Fraction(float(decode(fmt, direction[a])))
                point -= exact[k][a] * world
            off.append(float(point - exact[k][3]))
        inverse = np.linalg.inv(decode(fmt, rows)[:, :3])
        bound = Placed(fmt, rows, points).rounding() * unit * reach
        test = ROUNDING_ULPS * unit  # that of the triangle test comes on top
        worst = max(worst, (np.abs(inverse @ off).max() + test) / bound)
    assert 0.02 < worst < 1
