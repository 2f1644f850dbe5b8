"""sim.oracle.classify and sim.oracle.movement: a case of each class, explained and not."""

import json

import numpy as np
import pytest

from sim.oracle.classify import classify
from sim.oracle.taxonomy import CLASSES
from sim.oracle.trace import trace

INF = np.inf
ROUNDING = 0.01
VERTICES = np.array([
    *[(0, 0, 0), (1, 0, 0), (0, 1, 0)],  # triangle 0
    *[(-9, -9, 2), (9, -9, 2), (0, 9, 2)],  # 1: behind 0, and larger
    *[(5, 0, 0), (6, 0, 0), (5, 1, 0)],  # 3: beside 0, in its plane
    *[(0, 0, 0.008), (1, 0, 0.008), (0, 1, 0.008)],  # 4: hardly behind 0
])
FACES = np.array([[0, 1, 2], [3, 4, 5], [2, 0, 1], [6, 7, 8], [9, 10, 11]])
FRONT, BACK, COPY, BESIDE, CLOSE = range(5)
MIDDLE = (0.2, 0.3)
INSIDE = (0.2, 0.005)  # of FRONT, and near its edge
OUTSIDE = (0.2, -0.005)
FAR_OUTSIDE = (0.2, -0.5)
STRAIGHT = (0.0, 0.0, 2.0)
SLANTED = (1.0, 0.0, 0.1)  # incidence of about 84 degrees


def classified(point, found, found_t, direction=STRAIGHT, limits=(0.0, INF), faces=(0, 1, 3)):
    """One ray through a point of the plane of FRONT, t = 1 there; `faces` are in the mesh."""
    direction = np.array([direction], float)
    origin = np.array([[*point, 0.0]]) - direction
    faces = list(faces)
    rays = VERTICES, FACES[faces], origin, direction, *np.array([limits]).T
    truth = trace(*rays)
    taxonomy = classify(
        *rays,
        found_t=np.array([found_t]),
        found_triangle=np.array([faces.index(found) if found is not None else -1]),
        truth=truth,
        rounded_t=truth.t,
        rounding=np.array([ROUNDING]),
    )
    assert sum(taxonomy.counts.values()) == (taxonomy.kinds[0] >= 0)
    json.dumps(taxonomy.as_dict(), allow_nan=False)
    if taxonomy.kinds[0] < 0:
        return None
    kind = CLASSES[taxonomy.kinds[0]]
    assert taxonomy.counts[kind] == 1
    assert taxonomy.unexplained_rays == [0] * taxonomy.unexplained
    return kind, taxonomy.unexplained == 0


# t is in directions of length 2: 0.004 of it is 0.008 in space, within ROUNDING, and 0.006 is not.
@pytest.mark.parametrize(
    "kind, explained, case",
    [
        ("same_bits", True, (MIDDLE, FRONT, 1.0)),
        ("same_bits", True, (FAR_OUTSIDE, None, 77.0, STRAIGHT, (0, 1.5))),
        ("same_triangle", True, (MIDDLE, FRONT, 1.004)),
        ("same_triangle", True, (MIDDLE, FRONT, 0.996)),
        ("same_triangle", False, (MIDDLE, FRONT, 1.006)),
        ("same_triangle", False, (MIDDLE, FRONT, 0.994)),
        # At a slant t may be off by as much as takes the ray 0.01 away from the surface.
        ("same_triangle", True, (MIDDLE, FRONT, 1.09, SLANTED)),
        ("same_triangle", False, (MIDDLE, FRONT, 1.11, SLANTED)),
        # But not past the edge, where there is no surface at any height.
        ("same_triangle", False, ((0.69, 0.3), FRONT, 1.09, SLANTED)),
        ("same_triangle", False, (MIDDLE, FRONT, 1.004, STRAIGHT, (0, 1.003))),  # beyond t_max
        ("tie", True, (MIDDLE, COPY, 1.0, STRAIGHT, (0, INF), (0, 1, 2))),
        ("tie", True, (MIDDLE, COPY, 1.004, STRAIGHT, (0, INF), (0, 1, 2))),
        ("tie", True, (MIDDLE, CLOSE, 1.004, STRAIGHT, (0, INF), (0, 4))),
        ("tie", False, (MIDDLE, BESIDE, 1.0)),  # no such surface at this t
        ("hit_became_miss", True, (INSIDE, None, INF)),
        ("hit_became_miss", False, (MIDDLE, None, INF)),
        ("hit_became_miss", True, (MIDDLE, None, INF, STRAIGHT, (0, 1.004))),
        ("hit_became_miss", False, (MIDDLE, None, INF, STRAIGHT, (0, 1.006))),
        ("hit_became_miss", True, (MIDDLE, None, INF, STRAIGHT, (0.996, 5))),
        ("hit_became_miss", False, (MIDDLE, None, INF, STRAIGHT, (0.994, 5))),
        ("hit_became_miss", True, (MIDDLE, None, INF, (1, 0, 0.001))),  # edge-on
        ("hit_became_miss", False, (MIDDLE, None, INF, SLANTED)),
        ("miss_became_hit", True, (OUTSIDE, FRONT, 1.0, STRAIGHT, (0, 1.5))),
        ("miss_became_hit", False, (FAR_OUTSIDE, FRONT, 1.0, STRAIGHT, (0, 1.5))),
        ("miss_became_hit", True, (MIDDLE, FRONT, 0.996, STRAIGHT, (0, 0.997))),
        ("miss_became_hit", False, (MIDDLE, FRONT, 0.996, STRAIGHT, (0, 0.995))),
        ("miss_became_hit", False, (MIDDLE, FRONT, 0.99, STRAIGHT, (0, 0.995))),
        ("miss_became_hit", False, (MIDDLE, FRONT, INF, STRAIGHT, (3, INF))),  # t overflows
        ("nearer", True, (OUTSIDE, FRONT, 1.0)),
        ("nearer", False, (FAR_OUTSIDE, FRONT, 1.0)),
        ("nearer", False, (MIDDLE, BACK, 0.5)),
        ("nearer", True, (MIDDLE, FRONT, 1.003, STRAIGHT, (1.002, INF))),
        ("nearer", False, (MIDDLE, FRONT, 1.006, STRAIGHT, (1.002, INF))),
        ("farther", True, (INSIDE, BACK, 2.0)),
        ("farther", False, (MIDDLE, BACK, 2.0)),
        ("farther", False, (MIDDLE, COPY, 1.006, STRAIGHT, (0, INF), (0, 1, 2))),
        ("farther", False, (INSIDE, BACK, 2.006)),  # nor is this BACK's t
        ("farther", False, (INSIDE, BESIDE, 2.0)),
        ("farther", True, (MIDDLE, BACK, 2.0, STRAIGHT, (0.996, INF))),
        # Two surfaces 0.008 apart are 0.08 apart along a slanted ray.
        ("farther", True, (MIDDLE, CLOSE, 1.08, SLANTED, (0, INF), (0, 4))),
        ("farther", True, (MIDDLE, CLOSE, 1.09, SLANTED, (0, INF), (0, 4))),
        ("farther", False, (MIDDLE, CLOSE, 1.11, SLANTED, (0, INF), (0, 4))),
    ],
)
def test_class_and_explanation(kind, explained, case):
    assert classified(*case) == (kind, explained)


def test_ray_that_is_not_there():
    assert classified(MIDDLE, None, 1.0, limits=(2.0, 1.0)) is None
    assert classified(MIDDLE, FRONT, 1.0, limits=(2.0, 1.0)) == ("miss_became_hit", False)


def many(found_t, found, rounding):
    """Twelve rays at FRONT, t = 1, found as given; one number or one a ray."""
    origins = np.tile([0.2, 0.3, -2.0], (12, 1))
    rays = VERTICES, FACES, origins, np.tile(STRAIGHT, (12, 1)), np.zeros(12), np.full(12, INF)
    truth = trace(*rays)
    return classify(
        *rays,
        found_t=np.full(12, found_t),
        found_triangle=np.full(12, found),
        truth=truth,
        rounded_t=np.round(truth.t, 3),
        rounding=np.full(12, rounding),
    )


def test_the_first_ten_unexplained_are_named():
    rounding = np.full(12, ROUNDING)
    rounding[1] = 2.0  # so wide that it reaches an edge
    taxonomy = many(INF, -1, rounding)
    assert taxonomy.counts == dict.fromkeys(CLASSES, 0) | {"hit_became_miss": 12}
    assert taxonomy.unexplained == 11
    assert taxonomy.unexplained_rays == [0, *range(2, 11)]
    assert taxonomy.largest_movement == pytest.approx(0.2 / ROUNDING)  # the nearest edge
    assert taxonomy.largest_t_error is None and taxonomy.median_t_error is None


def test_errors_of_t_are_of_rays_with_the_same_triangle():
    found_t, found = np.linspace(1, 1.0011, 12), np.full(12, FRONT)
    found_t[11], found[11] = 3, BACK
    taxonomy = many(found_t, found, ROUNDING)
    assert taxonomy.largest_t_error == pytest.approx(0.001)
    assert taxonomy.median_t_error == pytest.approx(0.0005)
    assert taxonomy.kinds.tolist() == [0, *[1] * 10, CLASSES.index("farther")]
    assert taxonomy.unexplained_rays == [11]


def test_dictionary_is_json():
    taxonomy = many(INF, BACK, ROUNDING)
    assert taxonomy.largest_movement == INF
    assert json.loads(json.dumps(taxonomy.as_dict(), allow_nan=False)) == {
        "rays": 12,
        "counts": dict.fromkeys(CLASSES, 0) | {"farther": 12},
        "unexplained": 12,
        "unexplained_rays": list(range(10)),
        "largest_movement": None,
        "largest_t_error": None,
        "median_t_error": None,
    }


@pytest.mark.parametrize("wrong", [-2, len(FACES)])
def test_a_triangle_that_does_not_exist(wrong):
    with pytest.raises(ValueError, match=f"found triangle of ray 0: {wrong}, of a mesh of 5"):
        many(1.0, wrong, ROUNDING)
