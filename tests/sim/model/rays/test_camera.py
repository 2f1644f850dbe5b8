"""sim.model.rays.camera against exact arithmetic, a ray at a time."""

from dataclasses import fields

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from sim.compiler.rays import View
from sim.model.fp.format import encode
from sim.model.rays.camera import camera
from sim.report.pixels import camera_rays
from tests import oracle


def rounded(fmt, x):
    return oracle.decode(fmt, oracle.encode(fmt, x))


@pytest.mark.parametrize("size", [(1, 1), (2, 2), (3, 5), (7, 4)])
def test_each_pixel_once(rng, size):
    width, height = size
    vectors = encode(F24, rng.uniform(-1, 1, (4, 3)))
    origin, corner, right, down = vectors
    rays = camera(F24, *vectors, width, height, 5, 77)
    assert len(rays.pixels) == (width + 1) // 2 * ((height + 1) // 2) * 4
    inside = rays.pixels >= 0
    assert sorted(rays.pixels[inside]) == list(range(width * height))
    assert (rays.t_min[inside] == 5).all() and (rays.t_max[inside] == 77).all()
    infinity = oracle.encode(F24, float("inf"))
    assert (rays.t_min[~inside] == infinity).all()
    assert (rays.t_max[~inside] == oracle.encode(F24, float("-inf"))).all()
    assert (rays.origins == origin).all()
    for pixel, direction in zip(rays.pixels[inside], rays.directions[inside], strict=True):
        y, x = divmod(int(pixel), width)
        for axis in range(3):
            c, r, d = (oracle.decode(F24, int(v[axis])) for v in (corner, right, down))
            first = rounded(F24, c + rounded(F24, x * r))
            want = rounded(F24, first + rounded(F24, y * d))
            assert oracle.decode(F24, int(direction[axis])) == want


def test_packets_are_squares_along_rows():
    zero = np.zeros(3, np.int64)
    rays = camera(F24, zero, zero, zero, zero, 5, 3, 0, 0)
    assert rays.pixels.reshape(-1, 4).tolist() == [
        [0, 1, 5, 6],
        [2, 3, 7, 8],
        [4, -1, 9, -1],
        [10, 11, -1, -1],
        [12, 13, -1, -1],
        [14, -1, -1, -1],
    ]


@pytest.mark.parametrize(("packets", "bands"), [(1, 4), (4, 4), (6, 2), (9, 2), (100, 1)])
def test_bands_are_the_image(rng, packets, bands):
    vectors = encode(F24, rng.uniform(-1, 1, (4, 3)))
    view = View(*vectors, width=5, height=7, t_min=5, t_max=77)
    whole, parts = camera_rays(F24, view), [camera_rays(F24, v) for v in view.bands(packets)]
    assert len(parts) == bands
    assert not whole.overflow and not any(part.overflow for part in parts)
    for name in {field.name for field in fields(whole)} - {"overflow"}:
        joined = np.concatenate([getattr(part, name) for part in parts])
        assert (joined == getattr(whole, name)).all()
    assert [len(part.t_min) // 4 for part in parts] == [v.packets for v in view.bands(packets)]


@pytest.mark.parametrize("top", [-2, 1, 4])
def test_refuses_rows(top):
    zero = np.zeros(3, np.int64)
    with pytest.raises(ValueError, match=f"row {top} of 4"):
        camera(F24, zero, zero, zero, zero, 4, 4, 0, 0, top)


@pytest.mark.parametrize(("width", "height"), [(0, 1), (1, 0), (17, 1), (1, 17)])
def test_refuses_sizes(width, height):
    fmt, zero = FloatFormat(3, 2), np.zeros(3, np.int64)
    with pytest.raises(ValueError, match="width|height"):
        camera(fmt, zero, zero, zero, zero, width, height, 0, 0)
