"""sim.report.shade, normals and parts: colours of scenes whose answer is known."""

import numpy as np
import pytest

from sim.report.light import light
from sim.report.normals import smooth_normals
from sim.report.parts import PALETTE, parts, tints
from sim.report.seen import unit
from sim.report.shade import VIEWS, shade
from tests.sim.compiler.trees import icosphere
from tests.sim.report.views import CUBE, CUBE_FACES, SQUARE, joined, seen_from, square, wall

EYE = [1.5, 1, 4]


def angle(a, b):
    """Degrees between unit vectors."""
    return np.degrees(np.arccos(np.clip((a * b).sum(axis=-1), -1, 1)))


def grey_lightness(picture):
    """CIE lightness of sRGB greys."""
    value = picture[..., 0] / 255
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    return 116 * np.cbrt(linear) - 16


# Normals.


@pytest.mark.parametrize("level", [1, 2, 3])
def test_a_sphere_is_smooth(level):
    """Its triangles are wound at random."""
    seen = seen_from(EYE, icosphere(level))
    error = angle(smooth_normals(seen), unit(seen.points))
    assert error.max() < {1: 3, 2: 1, 3: 0.5}[level]
    assert angle(seen.flat_normals, unit(seen.points)).max() > 5 * error.max()


def test_a_cube_keeps_its_creases():
    seen = seen_from([2, 3, 4], (CUBE, CUBE_FACES))
    np.testing.assert_allclose(smooth_normals(seen), seen.flat_normals, atol=1e-12)
    assert len(np.unique(seen.flat_normals.round(6), axis=0)) == 3


@pytest.mark.parametrize(("degrees", "smooth"), [(20, True), (58, True), (66, False), (90, False)])
def test_a_fold_is_an_edge_from_62_degrees_on(degrees, smooth):
    half = np.radians(90 - degrees / 2)
    x, z = np.sin(half), -np.cos(half)
    fold = np.array([[0, -1, 0], [0, 1, 0], [x, -1, z], [x, 1, z], [-x, -1, z], [-x, 1, z]])
    faces = np.array([[0, 2, 1], [2, 3, 1], [0, 1, 4], [4, 1, 5]])
    seen = seen_from([0, 0, 5], (fold, faces), width=41, height=31)
    row = smooth_normals(seen)[np.abs(seen.points[:, 1]) < 0.05]
    middle = row[np.abs(row[:, 0]).argmin()]
    assert (angle(middle, np.array([0, 0, 1])) < 3) == smooth


def test_the_rim_of_a_cylinder_is_an_edge_and_its_side_is_round():
    """24 sides of one quad; the lid is a fan with a vertex of 24 triangles."""
    turn = 2 * np.pi * np.arange(24) / 24
    ring = np.stack([np.cos(turn), 0 * turn, np.sin(turn)], axis=1)
    vertices = np.concatenate([ring - [0, 1, 0], ring + [0, 1, 0], [[0, 1, 0]]])
    k, n = np.arange(24), (np.arange(24) + 1) % 24
    faces = [(k, n, n + 24), (k, n + 24, k + 24), (k + 24, n + 24, 0 * k + 48)]
    seen = seen_from([1, 3, 4], (vertices, np.concatenate([np.stack(f, 1) for f in faces])))
    normals, lid = smooth_normals(seen), seen.triangle[seen.hit] >= 48
    np.testing.assert_allclose(normals[lid], np.tile([0, 1, 0], (lid.sum(), 1)), atol=1e-6)
    assert angle(normals[~lid], unit(seen.points[~lid] * [1, 0, 1])).max() < 0.5
    assert min(lid.sum(), (~lid).sum()) > 50


def test_a_tip_of_very_many_triangles():
    turn = 2 * np.pi * np.arange(5000) / 5000
    ring = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    k = np.arange(5000)
    faces = np.stack([k, (k + 1) % 5000, 0 * k + 5000], axis=1)
    seen = seen_from([0, 0, 4], (np.concatenate([ring, [[0, 0, 0.2]]]), faces), 8, 9, 9)
    radial = seen.points[:, :2]
    normals = smooth_normals(seen)
    assert ((normals[:, :2] * radial).sum(axis=1) >= -0.01).all() and (normals[:, 2] > 0.97).all()


def test_both_sides_and_any_winding_look_alike(rng):
    vertices, faces = joined((CUBE, CUBE_FACES), square(wall(-3, 2)))
    seen = seen_from(EYE, (vertices, faces))
    flipped = seen_from(EYE, (vertices, faces[:, ::-1]))
    for view in ("shaded", "normal"):
        difference = shade(seen, view).astype(int) - shade(flipped, view)
        assert np.abs(difference).max() <= 1
    assert ((seen.flat_normals * seen.towards_eye).sum(axis=1) > 0).all()


def test_points_are_where_the_rays_meet_the_mesh():
    seen = seen_from(EYE, icosphere(1))
    y, x = np.nonzero(seen.hit)
    camera = seen.camera
    rays = camera.corner + x[:, None] * camera.right + y[:, None] * camera.down
    np.testing.assert_allclose(seen.points, camera.origin + seen.t[seen.hit][:, None] * rays)


# Views.


@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.parametrize("size", [(1, 1), (1, 9), (40, 1), (40, 30)])
def test_shapes_and_images_without_a_hit(view, size):
    for eye, target in ((EYE, [0, 0, 0]), (EYE, [9, 9, 9])):
        seen = seen_from(eye, icosphere(1), width=size[0], height=size[1], target=target)
        picture = shade(seen, view, lit=seen.hit)
        assert picture.shape == (size[1], size[0], 3) and picture.dtype == np.uint8
        if view != "shaded" and not seen.hit.any():
            assert not picture.any()


@pytest.mark.parametrize(
    ("eye", "colours"),
    [
        ([0, 0, 9], {(128, 128, 255)}),
        ([-9, 0, 0], {(128, 128, 255)}),
        ([9, 0, 9], {(218, 128, 218), (37, 128, 218)}),  # right and left sides
        ([0, 9, 9], {(128, 218, 218), (128, 37, 218)}),  # top and front
    ],
)
def test_normal_view(eye, colours):
    """Right is red, up green, to the viewer blue: 127.5 (n + 1)."""
    seen = seen_from(eye, (CUBE, CUBE_FACES), fov=25)
    picture = shade(seen, "normal")
    assert {tuple(c) for c in picture[seen.hit].tolist()} == colours
    assert not picture[~seen.hit].any()
    if len(colours) == 2:
        axis = 0 if eye[0] else 1  # red grows to the right, green upwards
        means = picture[..., axis].astype(float).sum(axis=axis) / seen.hit.sum(axis=axis).clip(1)
        means = means[means > 0]
        assert (means[-1] > means[0]) == (axis == 0)


def test_depth_view_is_even():
    """Four walls at equal steps: as bright in equal steps, the nearest brightest."""
    shift = np.array([[-1.5, 0, 0], [-0.5, 0, 0], [0.5, 0, 0], [1.5, 0, 0]])
    walls = [square(wall(-1.0 * k, 0.4) + shift[k]) for k in range(4)]
    seen = seen_from([0, 0, 8], joined(*walls))
    picture = shade(seen, "depth")
    assert (picture[..., :1] == picture).all() and not picture[~seen.hit].any()
    values = grey_lightness(picture)
    steps = [values[np.isin(seen.triangle, (2 * k, 2 * k + 1))] for k in range(4)]
    assert all(np.ptp(step) < 1e-9 for step in steps)
    means = np.array([step.mean() for step in steps])
    np.testing.assert_allclose(np.diff(means), -25, atol=0.5)
    assert means[0] > 90 and means[3] > 15


def test_depth_view_of_a_single_depth_and_of_a_given_range():
    seen = seen_from([0, 0, 4], square(wall(0)))
    assert shade(seen, "depth")[seen.hit].min() > 230
    one, other = (shade(seen, "depth", depths=d)[seen.hit].mean() for d in ((4, 8), (0, 8)))
    assert one > 230 > 160 > other > 100
    outside = shade(seen, "depth", depths=(1, 2))[seen.hit]
    assert 30 < outside.min() == outside.max() < 60


# The shaded view.


def test_what_the_lamp_does_not_reach_is_darker_and_not_black():
    seen = seen_from(EYE, icosphere(2), width=60, height=44)
    lit = seen.hit.copy()
    lit[:, 30:] = False
    full, half, none = (shade(seen, lit=x).astype(int) for x in (None, lit, 0 * seen.hit > 0))
    np.testing.assert_array_equal(shade(seen, lit=seen.hit), full)
    np.testing.assert_array_equal(half[:, :30], full[:, :30])
    np.testing.assert_array_equal(half[:, 30:], none[:, 30:])
    assert (none <= full).all() and none[seen.hit].min() > 25
    lamp = unit(light(seen.camera, seen.vertices) - seen.points)
    towards = (smooth_normals(seen) * lamp).sum(axis=1)
    change = (full - none)[seen.hit].sum(axis=1)
    assert (change[towards < -0.01] == 0).all() and (change[towards > 0.1] > 10).all()
    np.testing.assert_array_equal(half[~seen.hit], full[~seen.hit])


def test_the_upper_left_is_brightest():
    """Of a ball, and by the lamp that is given if one is."""
    seen = seen_from([0, 0, 4], icosphere(2), width=60, height=60)
    y, x = np.nonzero(seen.hit)
    for lamp, sign in ((None, -1), (np.array([9.0, -9, 9]), 1)):
        bright = shade(seen, lamp=lamp)[seen.hit].sum(axis=1)
        best = bright >= np.quantile(bright, 0.98)
        assert (x[best].mean() - 29.5) * sign > 3 and (y[best].mean() - 29.5) * sign > 3


def test_the_sky_is_a_quiet_gradient():
    seen = seen_from(EYE, icosphere(1), target=[90, 90, 90])
    sky = shade(seen).astype(int)
    assert not seen.hit.any() and (sky == sky[:, :1]).all()
    steps = np.diff(sky[:, 0], axis=0)
    assert (steps >= 0).all() and steps.max() < 20 and sky[0, 0, 2] > sky[0, 0, 0]


def test_colours_that_are_given():
    seen = seen_from([0, 0, 4], square(wall(0)))
    picture = shade(seen, colours=np.array([[0.5, 0, 0], [0, 0, 0.5]]))
    red, blue = (picture[seen.triangle == k].astype(int) for k in range(2))
    assert (red[:, 0] > red[:, 2] + 50).all() and (blue[:, 2] > blue[:, 0] + 50).all()


# Parts.


def test_parts_hang_together_by_place():
    """Two cubes without shared vertices at their edges, and a wall; triangles shuffled."""
    split = CUBE[CUBE_FACES].reshape(-1, 3), np.arange(36).reshape(12, 3)
    moved = split[0] + [5, 0, 0], split[1]
    vertices, faces = joined(split, square(wall(-3)), moved)
    want = np.repeat([0, 1, 2], [12, 2, 12])
    order = np.random.default_rng(5).permutation(len(faces))
    _, first = np.unique(want[order], return_index=True)
    rank = np.argsort(np.argsort(first))  # by first triangle
    assert parts(vertices, faces[order]).tolist() == rank[want[order]].tolist()
    np.testing.assert_array_equal(parts(vertices, faces), want)


@pytest.mark.parametrize("touching", [False, True])
def test_a_corner_is_enough_to_hang_together(touching):
    vertices, faces = joined(square(wall(0)), square(wall(0) + [2, 2 if touching else 2.1, 0]))
    assert len(set(parts(vertices, faces).tolist())) == (1 if touching else 2)


def test_parts_agree_with_a_search(rng):
    for _ in range(30):
        faces = rng.integers(0, 40, (15, 3))
        vertices = rng.integers(0, 4, (40, 3)).astype(float)
        groups = [{k} for k in range(15)]
        places = [{tuple(vertices[v]) for v in face} for face in faces.tolist()]
        for a in range(15):
            for b in range(a):
                if places[a] & places[b] and groups[a] is not groups[b]:
                    groups[a] |= groups[b]
                    for k in groups[b]:
                        groups[k] = groups[a]
        found = parts(vertices, faces)
        assert all(
            (found[a] == found[b]) == (groups[a] is groups[b]) for a in range(15) for b in range(15)
        )
        seen = list(dict.fromkeys(found.tolist()))
        assert seen == sorted(seen)


def test_tints_by_size_of_part():
    """The largest has the first colour, also if it has fewest triangles."""
    small = icosphere(1)
    vertices, faces = joined(small, square(wall(-5, 40)), (small[0] * 2 + [9, 0, 0], small[1]))
    colours = tints(vertices, faces)
    hexes = ["".join(f"{round(255 * c ** (1 / 2.2)):02x}" for c in row) for row in colours]
    count = len(small[1])
    assert hexes == [PALETTE[2]] * count + [PALETTE[0]] * len(SQUARE) + [PALETTE[1]] * count
