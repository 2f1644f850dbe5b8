"""Policies of updates: what they leave out is made up for, and what they cost is what is run."""

from fractions import Fraction

import numpy as np
import pytest

from hdl.config import FULL
from hdl.fp.format import F24, FloatFormat
from sim.cosim.verilate import simulator
from sim.errors import InputError
from sim.model.fp.format import decode, encode
from sim.model.rays.setup import margin_scale
from sim.model.rays.traversal import trace
from sim.model.refit import refit
from sim.prepare import prepare, view_of
from sim.report.pixels import camera_rays
from sim.scene.camera import auto
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from sim.study.policies.cycles import update_cycles
from sim.study.policies.margin import grown_margin
from sim.study.policies.measure import LISTED, SUMMED, measure
from sim.study.policies.plan import plan
from sim.study.policies.policy import POLICIES, parse

verilog = pytest.mark.skipif(simulator() == "icarus", reason="hundreds of times slower")
CONSERVATIVE = ["every", "every-3", "moved-0", "moved-0.01", "moved-0.04", "rebuild-2", "sah-1.02"]


@pytest.fixture(scope="module")
def two_rates():
    """A walker of which one leg in four goes on: some leaves move, most do not."""
    walker = load_scene("walker:500")
    rest = walker.pose(0)
    goes = rest[:, 0] > np.quantile(rest[:, 0], 0.75)

    def pose(frame):
        return np.where(goes[:, None], walker.pose(frame), walker.pose(frame // 4))

    return prepare(Scene("two rates", walker.faces, walker.frames, pose), FULL)


def hits_of(frame, margin, rays):
    """Bits t, u, v and the scene's triangle."""
    prepared, order = frame.prepared, frame.image.order
    corners = frame.bits[prepared.leaf_vertices]
    limits = rays.t_min, rays.t_max
    hits = trace(
        F24, order, frame.bounds, corners, rays.origins, rays.directions, *limits, margin=margin
    )
    hit = hits.triangle < len(order.triangles)
    triangle = np.where(hit, order.triangles[np.where(hit, hits.triangle, 0)], -1)
    return np.stack([hits.t, hits.u, hits.v, triangle])


def camera_of(prepared):
    poses = np.stack([prepared.scene.pose(frame) for frame in (0, 3)])
    view = view_of(F24, auto(poses, prepared.scene.faces, 40, 48))
    return view, camera_rays(F24, view)


def test_names():
    assert [parse(policy) for policy in ("every", "every-4", "moved-0.01", "sah-1.5")] == [
        ("every", 1),
        ("every", 4),
        ("moved", 0.01),
        ("sah", 1.5),
    ]
    assert POLICIES[0] == "every"
    assert len({parse(policy) for policy in POLICIES}) == len(POLICIES)


@pytest.mark.parametrize(
    "policy",
    ["", "never", "every-", "every-0", "every-2.5", "stale", "moved--1", "moved-nan", "sah-0.9",
     "sah-inf", "rebuild-x"],
)  # fmt: skip
def test_bad_names(policy):
    with pytest.raises(InputError, match=f"no policy {policy}: give every"):
        parse(policy)


@pytest.mark.parametrize("fmt", [F24, FloatFormat(5, 10), FloatFormat(8, 23)], ids=str)
def test_margins_are_rounded_up_by_less_than_an_ulp(fmt, rng):
    for _ in range(200):
        origin = encode(fmt, rng.normal(size=3) * 2.0 ** rng.integers(-3, 4))
        growth = float(rng.random() * 2.0 ** rng.integers(-20, 1))
        reach = 1 + max(Fraction(float(x)) for x in np.abs(decode(fmt, origin)))
        asked = Fraction(float(decode(fmt, margin_scale(fmt)))) + Fraction(growth) / reach
        bits = grown_margin(fmt, growth, origin)
        assert decode(fmt, bits - 1) < asked <= decode(fmt, bits)
    assert grown_margin(fmt, 0.0, encode(fmt, np.ones(3))) == margin_scale(fmt)


@pytest.mark.parametrize("policy", [*CONSERVATIVE, "stale-3"])
def test_grown_boxes_hold_their_triangles(two_rates, policy):
    most = {"moved-0.01": 0.01, "moved-0.04": 0.04, "every-3": 2}.get(policy, 0)
    held, grown = [], 0
    for frame in plan(two_rates, policy, range(7)):
        now = frame.bits[frame.prepared.leaf_vertices]
        need = decode(F24, refit(F24, frame.image.order, now))
        have = decode(F24, frame.bounds)
        low, high = have[:, ::2] - frame.growth, have[:, 1::2] + frame.growth
        held.append((low <= need[:, ::2]).all() and (need[:, 1::2] <= high).all())
        assert 0 <= frame.growth <= most
        grown += frame.growth > 0
    assert all(held) == (policy != "stale-3")
    assert (grown > 0) == (most > 0)


@pytest.mark.parametrize("policy", CONSERVATIVE)
def test_no_hit_is_lost(two_rates, policy):
    """Nor is any other, but where triangles meet: there a new tree may say which is first."""
    view, rays = camera_of(two_rates)
    frames = range(7)
    for frame, fresh in zip(
        plan(two_rates, policy, frames), plan(two_rates, "every", frames), strict=True
    ):
        margin = grown_margin(F24, frame.growth, view.origin)
        found, expected = hits_of(frame, margin, rays), hits_of(fresh, None, rays)
        other = (found != expected).any(axis=0)
        assert (found[0] == expected[0]).all()
        assert not other.any() or policy in ("rebuild-2", "sah-1.02")
        assert other.sum() <= 2


def test_what_runs(two_rates):
    """Programs of parts only where they are shorter; new trees when they are due."""
    frames, image = range(8), two_rates.image
    whole = [frame.program is image.instructions for frame in plan(two_rates, "every-3", frames)]
    assert whole == [True, False, False] * 2 + [True, False]
    parts = list(plan(two_rates, "moved-0", frames))
    assert [part.own_program for part in parts] == [False, True, True, True] * 2
    assert all(len(part.program) < len(image.instructions) for part in parts if part.own_program)
    assert all(len(part.boxes) for part in parts if part.own_program)
    rebuilt = [frame.rebuilt for frame in plan(two_rates, "rebuild-3", frames)]
    assert rebuilt == [True, False, False] * 2 + [True, False]
    assert [frame.rebuilt for frame in plan(two_rates, "sah-100", frames)] == [True] + [False] * 7
    assert sum(frame.rebuilt for frame in plan(two_rates, "sah-1", frames)) > 1


def test_nothing_moves_and_nothing_runs(two_rates):
    _, again = plan(two_rates, "moved-0", [4, 4])
    assert len(again.program) == 0
    assert again.growth == 0


@verilog
@pytest.mark.parametrize("policy", ["moved-0.02", "stale-2", "rebuild-2"])
def test_in_the_verilog(policy):
    cell = {"scene": "walker:500", "format": "7,16", "policy": policy, "frames": [0, 1, 2]}
    result = measure(cell | {"width": 40, "height": 48})
    each = result["per_frame"]
    assert result["mismatches"] == 0
    assert result["pixels"] == 1920
    assert set(each) == set(LISTED)
    assert all(result[name] == sum(each[name]) for name in SUMMED)
    assert all(len(values) == 3 for values in each.values())
    assert result["cycles"] == result["update_cycles"] + result["render_cycles"]
    assert result["different_share"] == result["different"] / (3 * 1920)
    if policy == "stale-2":
        assert each["lost"][0] == each["lost"][2] == 0 < each["lost"][1]
        assert each["update_cycles"][1] == 0 < each["update_cycles"][2]
    else:
        assert result["lost"] == result["false"] == 0
        assert result["changed"] == result["ties"]
    if policy == "rebuild-2":
        assert each["rebuilds"] == [1, 0, 1]
        assert [words > 0 for words in each["host_words"]] == [True, False, True]
        assert [cycles > 0 for cycles in each["program_cycles"]] == [False, True, False]
    if policy == "moved-0.02":
        assert each["growth"][1] > 0
        assert 0 < each["instructions"][1] < each["instructions"][0]
        assert each["host_words"][1] >= each["instructions"][1] / 4


@verilog
def test_update_alone(two_rates):
    """Each instruction takes a cycle or more; what the host writes, one a word."""
    frames = range(4)
    cycles = update_cycles(two_rates, "moved-0", frames)
    plans = list(plan(two_rates, "moved-0", frames))
    whole, *parts = zip(cycles, plans, strict=True)
    assert len(whole[1].program) < whole[0]
    for spent, frame in parts:
        least = len(frame.program) + len(frame.boxes) + len(frame.program) / 4
        assert least < spent < 1.5 * least + 200
    assert max(cycles[1:]) < whole[0]


@pytest.mark.parametrize("frames", [[], [0, 24], [-1]])
def test_frames_that_are_not_there(frames):
    cell = {"scene": "walker:500", "format": "7,16", "policy": "every", "frames": frames}
    with pytest.raises(InputError, match="frames are 0 to 23"):
        measure(cell | {"width": 8, "height": 8})
