"""sim.scene.camera: rays of a given camera, and what the chosen one shows, by brute force."""

import numpy as np
import pytest

from sim.errors import InputError
from sim.scene.builtin.figures import build_figure
from sim.scene.camera import auto, look_at, parse
from sim.scene.load import load_scene
from sim.scene.view import FILL
from tests.sim.compiler.trees import icosphere
from tests.sim.scene.casting import cast, directions, project

ONE = np.array([[0, 1, 2]], np.int32)
SQUARE = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
SIZES = [(64, 48), (37, 52), (1, 1), (2000, 1), (1, 500), (300, 7)]


def turned(points, degrees):
    """About y."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array(points, np.float64) @ np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])


def covered(camera, vertices, faces) -> float:
    return float((cast(camera, vertices, faces)[3] >= 0).mean())


# A camera that is given.


@pytest.mark.parametrize(("width", "height"), [(7, 5), (1, 1), (2, 100)])
def test_rays_of_a_camera_that_looks_along_minus_z(width, height):
    """At distance 2 with 90 degrees, the image is 4 high: pixels' middles lie within it evenly."""
    camera = look_at([1, 2, 5], [1, 2, 3], 90, width, height)
    rays = directions(camera)
    pixel = 2 / height
    x = (np.arange(width) - (width - 1) / 2) * pixel
    y = ((height - 1) / 2 - np.arange(height)) * pixel
    np.testing.assert_allclose(rays[..., 0], np.tile(x, (height, 1)), atol=1e-12)
    np.testing.assert_allclose(rays[..., 1], np.tile(y[:, None], (1, width)), atol=1e-12)
    np.testing.assert_allclose(rays[..., 2], -1, atol=1e-12)
    assert camera.origin.tolist() == [1, 2, 5] and (camera.width, camera.height) == (width, height)


def test_any_camera_is_square_upright_and_on_target(rng):
    for eye, target in rng.normal(size=(50, 2, 3)):
        camera = look_at(eye, target, 40, 9, 7)
        right, down, middle = camera.right, camera.down, directions(camera)[3, 4]
        assert np.linalg.norm(right) == pytest.approx(np.linalg.norm(down))
        assert np.abs([right @ down, right @ middle, down @ middle, right[1]]).max() < 1e-12
        assert down[1] < 0 and np.linalg.norm(middle) == pytest.approx(1)
        np.testing.assert_allclose(np.cross(middle, target - eye), 0, atol=1e-12)
        assert middle @ (target - eye) > 0
        assert np.cross(right, down) @ middle > 0  # no mirror


@pytest.mark.parametrize("target", [[0, -3, 0], [0, 3, 0], [1e-9, -3, 0]])
def test_straight_down_and_up(target):
    camera = look_at([0, 0, 0], target, 40, 9, 7)
    assert np.isfinite(camera.corner).all()
    np.testing.assert_allclose(directions(camera)[3, 4], np.sign(target) * [0, 1, 0], atol=1e-8)
    assert np.linalg.norm(camera.right) == pytest.approx(np.linalg.norm(camera.down))


@pytest.mark.parametrize("size", [1e-300, 1e-320, 1e300])
def test_any_magnitude_of_eye_and_target(size):
    camera = look_at([size, 0, 0], [-size, 0, 0], 40, 1, 1)
    np.testing.assert_allclose(camera.corner, [-1, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"width": 0}, "0 x 6 pixels"),
        ({"height": -1}, "8 x -1 pixels"),
        ({"fov": 0}, "above 0 and below 180 degrees, not 0"),
        ({"fov": 180}, "not 180"),
        ({"fov": np.nan}, "not nan"),
        ({"target": [1, 1, 1]}, "same point"),
        ({"eye": [np.inf, 0, 0]}, "not finite"),
        ({"target": [0, np.nan, 0]}, "not finite"),
    ],
)
def test_cameras_that_cannot_be(options, words):
    values = {"eye": [1, 1, 1], "target": [0, 0, 0], "fov": 40, "width": 8, "height": 6} | options
    with pytest.raises(InputError, match=words) as error:
        look_at(**values)
    assert "\n" not in str(error.value)


def test_parse():
    eye, target, fov = parse("1,-2.5,3e2, 4,5,6 ,35")
    assert (eye.tolist(), target.tolist(), fov) == ([1, -2.5, 300], [4, 5, 6], 35)
    assert isinstance(fov, float)


@pytest.mark.parametrize(
    "text",
    ["", "1,2,3,4,5,6", "1,2,3,4,5,6,7,8", "1,2,3,4,5,6,x", "1,2,3,nan,5,6,7", "inf,2,3,4,5,6,7"],
)
def test_parse_names_what_it_cannot_read(text):
    with pytest.raises(InputError, match="^--camera .*seven finite numbers") as error:
        parse(text)
    assert f"--camera {text}:" in str(error.value)


# A camera that is chosen.


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize(
    "vertices",
    [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0.5, 0]],
        [[0, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, 1]],
        [[0, 0, 0], [9, 0, 0], [9, 0, 1], [0, 0, 1]],
        [[0, 0, 0], [1, 1e-3, 0], [2, 0, 0], [1, -1e-3, 0]],
        [[0, 0, 0], [1, 1e-6, 0], [2, 0, 0], [1, -1e-6, 0]],
    ],
    ids=["upright", "edge on from z", "floor", "sliver", "needle"],
)
def test_few_triangles_fill_an_image_of_any_shape(vertices, width, height):
    vertices = np.array(vertices, np.float64)
    camera = auto(vertices[None], SQUARE, width, height)
    assert covered(camera, vertices, SQUARE) >= FILL - 0.03
    assert (camera.width, camera.height) == (width, height)


@pytest.mark.parametrize("figure", ["walker:2000", "room:400", "burst:500", "waves:500"])
def test_figures_fill_the_image(figure):
    scene = build_figure(figure, 24)
    camera = auto(np.stack([scene.pose(f) for f in (0, 8, 16)]), scene.faces, 64, 48)
    assert covered(camera, scene.pose(0), scene.faces) >= FILL - 0.03
    assert camera.origin[1] > scene.pose(0)[:, 1].mean()  # from a little above


def test_all_of_what_fills_is_shown_in_all_poses():
    """A ball that jumps a little: whole, near the edge of the image somewhere, and upright."""
    vertices, faces = icosphere(2)
    poses = vertices + np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]])[:, None]
    camera = auto(poses, faces, 64, 48)
    x, y, depth = project(camera, poses).T
    assert depth.min() > 0
    assert -0.5 <= x.min() and x.max() <= 63.5 and -0.5 <= y.min() and y.max() <= 47.5
    assert y.min() < 3 and y.max() > 44
    assert camera.down[1] < 0 and camera.right[1] == 0


def test_what_moves_away_does_not_keep_the_camera_from_the_first_pose():
    vertices, faces = icosphere(1)
    poses = np.stack([vertices, vertices + [60, 0, 0], vertices + [0, 0, -90]])
    camera = auto(poses, faces, 64, 48)
    assert covered(camera, vertices, faces) >= FILL - 0.03


def test_other_poses_count_where_not_all_can_be_shown():
    """A long bar is cut at the side at which it is not in the other poses."""
    x = np.linspace(-10.0, 10.0, 41)
    bar = np.concatenate([np.stack([x, 0 * x + y, 0 * x], axis=1) for y in (-1, 1)])
    k = np.arange(40)
    faces = np.concatenate([np.stack([k, k + 1, k + 41], 1), np.stack([k + 1, k + 42, k + 41], 1)])
    for side in (-1, 1):
        shrunk = bar * [0.1, 1, 1] + [8 * side, 0, 0]
        poses = np.stack([bar, *[shrunk] * 4])
        camera = auto(poses, faces, 48, 48)
        column, row, _ = project(camera, shrunk).T
        inside = (column >= -0.5) & (column <= 47.5) & (row >= -0.5) & (row <= 47.5)
        assert inside.mean() > 0.7
        assert covered(camera, bar, faces) >= FILL - 0.03


@pytest.mark.parametrize("degrees", [0, 90, 180, -90])
def test_looks_into_a_box_that_is_open_at_a_side(degrees):
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    quads = [(0, 2, 6, 4), (0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6)]  # not z = 1
    faces = np.array([(a, *pair) for a, b, c, d in quads for pair in ((b, c), (c, d))], np.int32)
    normal = np.cross(*(corners[faces[:, k]] - corners[faces[:, 0]] for k in (1, 2)))
    outward = (normal * corners[faces[:, 0]]).sum(axis=1) > 0
    faces[outward] = faces[outward][:, ::-1]  # all fronts are inside
    vertices = turned(corners, degrees)
    camera = auto(vertices[None], faces, 64, 48)
    triangle = cast(camera, vertices, faces)[3]
    assert set(range(10)) - set(triangle.ravel().tolist()) == set()  # every wall is seen
    out = turned([[0, 0, 1]], degrees)[0]
    assert camera.origin @ out > 0.7 * np.linalg.norm(camera.origin)


@pytest.mark.parametrize(("width", "height"), SIZES)
@pytest.mark.parametrize(
    "vertices",
    [
        [[0, 0, 0]] * 3,
        [[5, -6, 7]] * 3,
        [[0, 0, 0], [1, 1, 1], [3, 3, 3]],
        [[0, 0, 0], [0, 1, 0], [0, 2, 0]],
    ],
    ids=["origin", "point", "line", "plumb line"],
)
def test_what_has_no_area_is_in_the_image(vertices, width, height):
    vertices = np.array(vertices, np.float64)
    camera = auto(vertices[None], ONE, width, height)
    x, y, depth = project(camera, vertices).T
    assert depth.min() > 0
    assert (
        x.min() >= -0.5 and x.max() <= width - 0.5 and y.min() >= -0.5 and y.max() <= height - 0.5
    )


@pytest.mark.parametrize("scale", [2.0**-300, 2.0**300])
def test_size_and_place_do_not_matter(scale):
    scene = build_figure("walker:500", 24)
    poses = np.stack([scene.pose(0), scene.pose(6)])
    camera, other = auto(poses, scene.faces, 64, 48), auto(poses * scale, scene.faces, 64, 48)
    np.testing.assert_array_equal(other.origin, camera.origin * scale)
    np.testing.assert_array_equal(other.corner, camera.corner)
    moved = auto(poses + [64, -32, 128], scene.faces, 64, 48)
    np.testing.assert_allclose(moved.origin, camera.origin + [64, -32, 128], atol=1e-9)
    np.testing.assert_allclose(moved.corner, camera.corner, atol=1e-2)


def test_vertices_that_no_triangle_uses_do_not_matter():
    vertices, faces = icosphere(1)
    camera = auto(vertices[None], faces, 64, 48)
    more = np.concatenate([vertices, [[1e6, 0, 0]]])
    np.testing.assert_array_equal(auto(more[None], faces, 64, 48).corner, camera.corner)


def test_an_image_without_pixels():
    with pytest.raises(InputError, match="0 x 5 pixels"):
        auto(np.eye(3)[None], ONE, 0, 5)


@pytest.mark.parametrize(
    ("name", "frame"),
    [("elephant.npz", 20), ("Fox.glb", 0), ("CornellBox.glb", 0), ("MorphStressTest.gltf", 0)],
)
def test_real_scenes_fill_the_image(scene_file, name, frame):
    scene = load_scene(str(scene_file(name)))
    vertices = scene.pose(frame)
    camera = auto(vertices[None], scene.faces, 32, 24)
    assert covered(camera, vertices, scene.faces) >= FILL - 0.05
