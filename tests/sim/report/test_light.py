"""sim.report.light: where the lamp is, and the rays that reach it."""

import numpy as np
import pytest

from sim.report.light import light, shadow_rays
from tests.sim.compiler.trees import icosphere
from tests.sim.report.views import joined, seen_from, square, wall
from tests.sim.scene.casting import intersect, project


@pytest.mark.parametrize("eye", [[0, 0, 5], [3, 2, -4], [-5, 0.1, 0]])
@pytest.mark.parametrize("size", [1e-3, 1, 1e3])
def test_lamp_is_to_the_upper_left_and_grows_with_the_scene(eye, size):
    seen = seen_from(np.multiply(eye, size), (icosphere(1)[0] * size, icosphere(1)[1]))
    lamp, camera = light(seen.camera, seen.vertices), seen.camera
    aside = lamp - camera.origin
    distance = np.linalg.norm(camera.origin)
    assert aside @ camera.right < 0 and aside @ camera.down < 0
    assert 0.5 < np.linalg.norm(aside) / distance < 1
    middle = camera.corner + 19.5 * camera.right + 14.5 * camera.down
    assert abs(aside @ middle) < 1e-9 * distance


def test_rays_reach_the_lamp_from_off_the_surface():
    seen = seen_from([1.5, 1, 4], icosphere(1))
    lamp = np.array([-3.0, 5, 4])
    origins, directions = shadow_rays(seen, lamp, 0.01)
    np.testing.assert_allclose(origins + directions, np.broadcast_to(lamp, origins.shape))
    step = origins - seen.points
    largest = np.abs(seen.vertices).max()
    np.testing.assert_allclose((step * seen.flat_normals).sum(axis=1), 0.01 * largest)
    np.testing.assert_allclose(np.linalg.norm(step, axis=1), 0.01 * largest)
    assert (project(seen.camera, origins)[:, 2] < project(seen.camera, seen.points)[:, 2]).all()


def test_a_square_casts_its_shadow():
    """Between lamp and wall, twice as far from the wall as large: known to the pixel's edge."""
    blocker = square(wall(1.0, 0.25))
    seen = seen_from([0, 0.0, 9], joined(square(wall(0, 3)), blocker), width=80, height=60)
    lamp = np.array([-1.0, 1.0, 2.0])
    origins, directions = shadow_rays(seen, lamp, 1e-6)
    hit = intersect(origins, directions, seen.vertices, seen.faces, 1.0)[3] >= 0
    at = seen.points
    # half way from the wall to the lamp the ray passes (at + lamp) / 2
    want = (np.abs((at + lamp) / 2)[:, :2] < 0.25).all(axis=1) & (at[:, 2] == 0)
    edge = np.abs(np.abs((at + lamp) / 2)[:, :2] - 0.25).min(axis=1) < 1e-5
    assert want.sum() > 20
    np.testing.assert_array_equal(hit[~edge], want[~edge])


def test_nothing_is_seen():
    seen = seen_from([0, 0, 5], icosphere(1), target=[0, 0, 9])
    assert [x.shape for x in shadow_rays(seen, np.ones(3), 0.01)] == [(0, 3), (0, 3)]
