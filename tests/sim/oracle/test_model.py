"""The golden model against the oracle: rounding explains every ray on which they differ."""

from functools import cache

import numpy as np
import pytest

from hdl.config import FULL
from hdl.rays.packet import NO_TRIANGLE
from sim.model.fp.format import decode, encode
from sim.model.rays.traversal import trace as model_trace
from sim.model.refit import refit
from sim.oracle.classify import classify
from sim.oracle.taxonomy import CLASSES
from sim.oracle.trace import trace
from sim.prepare import prepare
from sim.scene.load import load_scene

FMT = FULL.fmt
FRAME = 20
HALF_ULPS = 18
"""What the triangle test may be off, in half ulps of the largest distance: sim.model.rays.setup."""


def camera(width, height):
    """Rays from in front of the elephant and from above; neighbours stay together."""
    eye = np.array([1.9, 0.7, 1.9])
    right, up = np.array([0.71, 0, -0.71]), np.array([-0.18, 0.97, -0.18])
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, width), np.linspace(-0.4, 0.4, height))
    directions = x[..., None] * right + y[..., None] * up - eye / np.linalg.norm(eye)
    return np.tile(eye, (width * height, 1)), directions.reshape(-1, 3)


def grazing(rng, corners, count):
    """Rays almost in the plane of a triangle, through a point of it."""
    a, b, c = corners[rng.integers(len(corners), size=count)].transpose(1, 0, 2)
    directions = (b - a) * rng.standard_normal((count, 1)) + (c - a)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions += rng.standard_normal((count, 3)) * 10.0 ** rng.uniform(-7, -1, (count, 1))
    return (a + b + c) / 3 - directions * rng.uniform(0.1, 2, (count, 1)), directions


class Frame:
    """One frame of a scene, and what the model hits in it."""

    def __init__(self, path):
        self.prepared = prepare(load_scene(str(path)), FULL, frames=range(FRAME, FRAME + 1))
        self.bits = self.prepared.coordinates(FRAME)
        self.vertices = decode(FMT, self.bits)
        self.faces = self.prepared.leaf_vertices

    def compare(self, origins, directions, broken=lambda found: found, share=1.0):
        """Class the model's hits, after `broken` has changed their triangles."""
        bits = [encode(FMT, x) for x in (origins, directions)]
        bits += [encode(FMT, np.full(len(origins), t)) for t in (0.0, np.inf)]
        order, corners = self.prepared.image.order, self.bits[self.faces]
        hits = model_trace(FMT, order, refit(FMT, order, corners), corners, *bits)
        found = np.where(hits.triangle == NO_TRIANGLE, -1, hits.triangle)
        rays = self.vertices, self.faces, *(decode(FMT, x) for x in bits)
        truth = trace(*rays)
        largest = 1 + np.abs(rays[2]).max(axis=1)
        return classify(
            *rays,
            found_t=decode(FMT, hits.t),
            found_triangle=broken(found),
            truth=truth,
            rounded_t=decode(FMT, encode(FMT, truth.t)),
            rounding=share * HALF_ULPS * 2.0 ** -(FMT.man_bits + 1) * largest,
        )


@cache
def load(path):
    return Frame(path)


@pytest.fixture
def elephant(scene_file):
    return load(scene_file("elephant.npz"))


def test_picture(elephant):
    taxonomy = elephant.compare(*camera(160, 120))
    assert taxonomy.unexplained == 0, taxonomy
    same = taxonomy.counts["same_bits"] + taxonomy.counts["same_triangle"]
    assert same > 0.995 * 160 * 120
    assert taxonomy.median_t_error < 2.0**-FMT.man_bits


def test_grazing_rays(elephant, rng):
    taxonomy = elephant.compare(*grazing(rng, elephant.vertices[elephant.faces], 4000))
    assert taxonomy.unexplained == 0, taxonomy
    met = [name for name, count in taxonomy.counts.items() if count]
    assert set(met) | {"tie"} == set(CLASSES), taxonomy


def test_bound_is_no_wider_than_it_must_be(elephant, rng):
    rays = grazing(rng, elephant.vertices[elephant.faces], 4000)
    assert elephant.compare(*rays, share=0.05).unexplained > 0


def lose_one(found):
    return np.where(np.arange(len(found)) == np.flatnonzero(found >= 0)[1000], -1, found)


def hit_another(found):
    ray = np.flatnonzero(found >= 0)[1000]
    return np.where(np.arange(len(found)) == ray, (found + 5000) % found.max(), found)


def hit_one_of_nothing(found):
    return np.where(np.arange(len(found)) == np.flatnonzero(found < 0)[1000], 0, found)


@pytest.mark.parametrize("broken", [lose_one, hit_another, hit_one_of_nothing])
def test_a_broken_model_is_not_explained(elephant, broken):
    assert elephant.compare(*camera(160, 120), broken).unexplained == 1
