"""The study of stiff motion: rates, bounds after many updates, and when a new tree is worth it."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from hdl.config import FULL
from sim.model import update
from sim.prepare import prepare
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from sim.study.motion import carried, costs
from sim.study.motion.carried import carried as carry
from sim.study.motion.cells import SCENES, cells
from sim.study.motion.measure import measure
from sim.study.motion.plot import figure
from sim.study.motion.rates import rates
from sim.study.motion.tables import caption, grids
from sim.study.page import picture
from sim.tree.build import build

PRICES = costs.Prices(triangles=1000, words=3000, rays=100_000, update=3000, clock_mhz=80.0)


def test_rates_of_points_that_move_at_known_speeds():
    speeds = np.concatenate([np.zeros(50), np.full(5, 1e-7), np.full(440, 1e-3), np.full(5, 0.1)])
    points = np.random.default_rng(1).uniform(-1, 1, (500, 3))

    def pose(frame: int) -> np.ndarray:
        return points if frame == 9 else points + frame * speeds[:, None] * [0, 1, 0]

    scene = Scene("points", np.zeros((1, 3), np.int32), 11, pose)
    still = Scene("still", np.zeros((1, 3), np.int32), 11, lambda frame: points)
    assert rates(scene, [0, 4]) == pytest.approx([1e6, 1e6])
    assert rates(still, [0]) == [None]


@pytest.mark.parametrize("name", SCENES)
def test_bounds_are_those_of_clean_memory(name):
    prepared = prepare(load_scene(f"{name}:300", period=40), FULL)
    found = carry(prepared)
    assert found["updates"] == 40 and found["words"] == 40 * prepared.image.nodes
    assert found["differing"] == 0 and 0.2 < found["moved"] <= 1


def test_a_bound_that_is_not_written_is_counted(monkeypatch):
    prepared = prepare(load_scene("collapse:300", period=40), FULL)

    def forgetful(config, instructions, vertices, bounds):
        """The root is written once only."""
        after = update.execute(config, instructions, vertices, bounds)
        if bounds.any():
            after[-1] = bounds[-1]
        return after

    monkeypatch.setattr(carried, "execute", forgetful)
    assert carry(prepared)["differing"] == 39  # it moves in all frames


def test_prices():
    assert PRICES.rebuild == 1000 * costs.HOST_SECONDS * 80e6 + 3000
    above = PRICES.most * PRICES.rays * costs.CYCLES_PER_STEP
    assert PRICES.update + above == pytest.approx(PRICES.rebuild)


def test_refit_stops_paying_where_it_does():
    """Against every frame, tried one by one."""
    scene = prepare(load_scene("explosion:300", period=60), FULL).scene
    tree = build(scene.pose(0), scene.faces)
    frames = list(range(0, 60, 12))
    all_above = np.array([costs.excess(scene, tree, frame) for frame in range(60)])
    assert all_above[0] == 0 and (np.diff(all_above[:20]) > 0).all()
    samples = all_above[frames].tolist()
    for most in all_above[[5, 12, 17]] - 1e-6:
        prices = replace(PRICES, words=0, triangles=0, update=0)
        prices = replace(prices, words=round(most * prices.rays * costs.CYCLES_PER_STEP))
        first = int(np.argmax(all_above > prices.most))
        assert costs.stops(scene, tree, frames, samples, prices) == first
        lost = np.flatnonzero(np.cumsum(all_above) > prices.most)[0]
        assert abs(costs.repaid(scene, tree, frames, samples, prices) - lost) <= 2
    never = replace(PRICES, triangles=10**9)
    assert costs.stops(scene, tree, frames, samples, never) is None
    assert costs.repaid(scene, tree, frames, samples, never) is None
    free = replace(PRICES, triangles=0, words=0)
    assert costs.stops(scene, tree, frames, samples, free) == 0


@pytest.fixture(scope="module")
def results() -> list[dict]:
    """As of sim.study.motion.measure, without the work."""
    frames = [0, 100, 200, 300]
    result = {
        "scene": "shock:2000",
        "format": "7,16",
        "triangles": 1984,
        "updates": 400,
        "differing": 0,
        "mismatches": 0,
        "verilog_frames": [0, 200],
        "rates_median": 1234.0,
        "rates_largest": None,
        "frames": frames,
        "sah": {"poses": [9, 9, 10, 12], "first": [8, 30, 40, 30], "rebuilt": [8, 8, 9, 9]},
        "stops": {"poses": None, "first": 61},
        "repaid": 7,
        "most": 9.5,
        "rebuild_cycles": 500_000,
        "policies": {"every": 5100.0, "every-4": 1275.0},
    }
    return [result, {**result, "scene": "cloth:2000"}, {"scene": "room:2", "refused": "too small"}]


def test_tables_fit_a_terminal(results):
    console = Console(width=80, record=True, file=io.StringIO())
    console.print(*(grid.shown() for grid in grids(results)))
    text = console.export_text()
    for word in ("shock", "1e3 to none", "never", "61", "too small", "1,275", "1.33"):
        assert word in text, text
    assert "…" not in text and "500,000 cycles" in caption(results)


def test_figures_are_readable_and_the_same_each_time(results):
    with Image.open(io.BytesIO(picture(figure(results[0]), "png", "it"))) as drawn:
        assert drawn.size == (1280, 800)
    svg = picture(figure(results[0]), "svg", "it")
    assert svg == picture(figure(results[0]), "svg", "it")
    assert svg.startswith(b"<?xml") and b"<svg" in svg


@pytest.mark.slow
def test_a_scene_in_whole():
    cell = {**cells(triangles=300, frames=80)[2], "samples": 5, "verilog": 3}
    result = measure(cell)
    assert json.loads(json.dumps(result)) == result
    assert (result["differing"], result["mismatches"], result["updates"]) == (0, 0, 80)
    assert result["verilog_frames"] == [0, 26, 52, 78]
    assert {len(costs) for costs in result["sah"].values()} == {5}
    assert result["policies"]["every-4"] < result["policies"]["moved-0"] < result["update_cycles"]
