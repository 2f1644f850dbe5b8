"""sim.scene.visible and crop, which a view is chosen by, against brute force."""

import numpy as np
import pytest

from sim.scene.crop import crop
from sim.scene.visible import BACK, GRAZING, bounds, project, visible
from tests.sim.compiler.trees import icosphere
from tests.sim.scene.casting import intersect

WHOLE = np.array([-0.5, -0.4, 0.5, 0.4])


def square(half, depth):
    corners = [
        [-half, half, depth],
        [half, half, depth],
        [half, -half, depth],
        [-half, -half, depth],
    ]
    points = np.array(corners, np.float64)
    return points, np.array([[0, 1, 2], [0, 2, 3]])  # fronts to the eye


def on_plane(points):
    return np.concatenate([points[:, :2] / points[:, 2:], points[:, 2:]], axis=1)


def test_project_and_bounds(rng):
    points = rng.uniform(-1, 1, (20, 3))
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    along = points @ axes.T + [0, 0, 3]
    projected = project(points, axes, 3.0)
    np.testing.assert_allclose(projected, on_plane(along))
    window = bounds(projected)
    np.testing.assert_array_equal(window[:2], projected[:, :2].min(axis=0))
    np.testing.assert_array_equal(window[2:], projected[:, :2].max(axis=0))


def test_the_nearest_is_visible_in_any_order(rng):
    corners = rng.uniform([-0.6, -0.6, 0.5], [0.6, 0.6, 3], (60, 3)) * [1, 1, 1]
    faces = np.arange(60).reshape(20, 3)
    x = -0.5 + (np.arange(24) + 0.5) / 24
    y = -0.4 + (np.arange(16) + 0.5) * 0.8 / 16
    rays = np.stack([*np.broadcast_arrays(x, y[:, None], 1.0)], axis=-1).reshape(-1, 3)
    t, _, _, triangle = intersect(np.zeros(3), rays, corners, faces)
    for order in (np.arange(20), np.arange(20)[::-1]):
        covered, surface = visible(on_plane(corners), faces[order], WHOLE, 24, 16)
        np.testing.assert_array_equal(covered.ravel(), triangle >= 0)
        normal = np.cross(
            *(corners[faces[triangle, k]] - corners[faces[triangle, 0]] for k in (1, 2))
        )
        reach = np.linalg.norm(rays, axis=1)
        cosine = (normal * rays).sum(axis=1) / np.linalg.norm(normal, axis=1) / reach
        cell = 0.8 / 16 / 24
        want = cell * t**2 / reach / np.maximum(np.abs(cosine), GRAZING)
        want = np.where(cosine < 0, want, BACK * want)
        np.testing.assert_allclose(surface.ravel()[triangle >= 0], want[triangle >= 0])
        assert not surface.ravel()[triangle < 0].any()


def test_surface_is_an_area():
    """A square of 0.36, from the front, and from the back; a far ball."""
    points, faces = square(0.3, 1.0)
    for turned, share in ((faces, 1.0), (faces[:, ::-1], BACK)):
        _, surface = visible(on_plane(points), turned, WHOLE, 200, 200)
        assert surface.sum() == pytest.approx(0.36 * share, rel=0.02)
    ball, faces = icosphere(3)
    projected = on_plane(0.5 * ball + [0, 0, 50])
    normal = np.cross(*(ball[faces[:, k]] - ball[faces[:, 0]] for k in (1, 2)))
    inward = (normal * ball[faces[:, 0]]).sum(axis=1) < 0
    faces[inward] = faces[inward][:, ::-1]
    _, surface = visible(projected, faces, bounds(projected), 200, 200)
    # beyond 75 degrees the rim counts as if it were at 75: of a half, cos 75 becomes half of it
    assert surface.sum() == pytest.approx(2 * np.pi * 0.5**2 * (1 - GRAZING / 2), rel=0.03)


def brute_crop(covered, shown, aspect, fill):
    """Most that any box of whole cells and about this aspect shows, being filled."""
    rows, columns = covered.shape
    best = -1.0
    for high in range(1, rows + 1):
        wide = max(1, round(high * aspect))
        if wide > columns:
            break
        for y in range(rows - high + 1):
            for x in range(columns - wide + 1):
                box = slice(y, y + high), slice(x, x + wide)
                if covered[box].mean() >= fill:
                    best = max(best, shown[box].sum())
    return best


@pytest.mark.parametrize("aspect", [1.0, 2.0, 0.5])
def test_crop_shows_most_of_all_that_fill(rng, aspect):
    for _ in range(20):
        covered = rng.random((16, 16)) < rng.uniform(0.2, 0.7)
        shown = covered * rng.random((16, 16))
        window = np.array([-1.0, 2, 15, 18])  # cells of 1
        part, share, worth = crop(covered, shown, window, aspect, 0.45)
        best = brute_crop(covered, shown, aspect, 0.45)
        assert worth >= best - 1e-9
        size = part[2:] - part[:2]
        assert size[0] / size[1] == pytest.approx(aspect)
        assert share >= 0.45
        # what it says of itself is true of the cells it holds
        wide, high = (max(1, round(x)) for x in size.tolist())
        x, y = np.rint((part[:2] + part[2:]) / 2 - [wide / 2, high / 2] - window[:2]).astype(int)
        box = slice(max(y, 0), max(y, 0) + high), slice(max(x, 0), max(x, 0) + wide)
        if wide <= 16 and high <= 16:
            assert share == pytest.approx(covered[box].mean())
            assert worth == pytest.approx(shown[box].sum())


def test_crop_is_all_of_it_if_that_fills():
    covered = np.ones((10, 20), bool)
    window = np.array([0.0, 0, 20, 10])
    part, share, worth = crop(covered, covered * 1.0, window, 2.0, 0.45)
    assert (part.tolist(), share, worth) == ([0, 0, 20, 10], 1, 200)
    part, share, worth = crop(covered, covered * 1.0, window, 1.0, 0.45)
    assert (part.tolist(), share, worth) == ([0, -5, 20, 15], 0.5, 200)
    part, share, worth = crop(covered, covered * 1.0, window, 4.0, 0.45)
    assert (part.tolist(), share, worth) == ([-10, 0, 30, 10], 0.5, 200)


def test_crop_where_nothing_fills():
    window = np.array([0.0, 0, 10, 10])
    covered = np.zeros((10, 10), bool)
    part, share, _ = crop(covered, covered * 1.0, window, 1.0, 0.45)
    assert share <= 0 and np.isfinite(part).all()
    covered[6, 2] = True
    part, share, worth = crop(covered, covered * 1.0, window, 50.0, 0.45)
    assert abs((part[0] + part[2]) / 2 - 2.5) < 1 and (part[1] + part[3]) / 2 == 6.5
