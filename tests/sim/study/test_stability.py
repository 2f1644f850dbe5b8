"""sim.study.stability: its exact decisions and its bound, cases at small sizes, and the command."""

import json
import sys
from fractions import Fraction
from functools import partial

import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from sim.cli import main
from sim.errors import InputError
from sim.oracle.intersect import intersect
from sim.study.stability import exact
from sim.study.stability.cases import wrong
from sim.study.stability.closed import closed, moved, scaled
from sim.study.stability.degenerate import degenerate
from sim.study.stability.ends import ends
from sim.study.stability.room import screw
from sim.study.stability.shapes import cube, icosphere, middles
from sim.study.stability.slivers import decisions, near_edge, sliver
from sim.study.stability.tables import caption
from sim.study.stability.tracers import Found, Machine, systems

OURS = systems(F24, False)
FORMATS = [F24, FloatFormat(8, 23), FloatFormat(5, 10), FloatFormat(4, 9)]


def random_cases(rng, count):
    """Triangles and rays with few bits: hits, misses, and rays at corners, edges and edge-on."""
    points = rng.integers(-3, 4, (count, 5, 3)).astype(np.float64)
    aimed = rng.random(count) < 0.5
    points[aimed, 4] = points[aimed, 0] - points[aimed, 3]
    return points[:, :3], points[:, 3], points[:, 4]


def test_exact_decisions_are_those_of_the_oracle(rng):
    kinds = set()
    for corners, origin, direction in zip(*random_cases(rng, 3000), strict=True):
        t = intersect(*corners, origin, direction, np.zeros(3))
        expected = bool(t >= 0)  # NaN where it misses
        assert exact.hits(corners, origin, direction) == expected
        kinds.add((expected, bool(np.isnan(t))))
    assert kinds == {(True, False), (False, False), (False, True)}


@pytest.mark.parametrize("numbers", [(0.0, -0.0, 1.0), (1e-300, 3.0, -1e300), (0.1, 2.0**-1074, 5)])
def test_integers_are_the_numbers(numbers):
    (found,) = exact.integers(np.array([numbers]))
    unit = Fraction(found[2]) / Fraction(numbers[2])
    assert list(found) == [Fraction(x) * unit for x in numbers]
    assert (unit.numerator & (unit.numerator - 1), unit.denominator) == (0, 1)  # a power of two


@pytest.mark.parametrize("mesh", [icosphere(2), cube(3), screw(np.random.default_rng(1))])
def test_meshes_are_closed(mesh):
    vertices, faces = mesh
    sides = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, counts = np.unique(np.sort(sides, axis=1), axis=0, return_counts=True)
    assert (counts == 2).all()
    assert len(vertices) - len(middles(vertices, faces)) + len(faces) == 2  # Euler
    assert len(np.unique(faces)) == len(vertices) == len(np.unique(vertices, axis=0))


def test_the_sphere_is_that_of_the_figures():
    vertices, faces = icosphere(6)
    assert (len(vertices), len(faces), len(middles(vertices, faces))) == (40_962, 81_920, 122_880)


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
@pytest.mark.parametrize("case", [closed, moved, scaled])
def test_no_ray_is_lost(case, fmt, rng):
    rows = case(systems(fmt, False), rng, 3)
    assert len(rows) >= 4
    assert {row["verdict"] for row in rows} == {"0 lost"}
    assert all(row["ok"] for row in rows)


class Careless(Machine):
    """A machine that loses every hundredth hit."""

    def first(self, origins, directions):
        found = super().first(origins, directions)
        lost = np.arange(len(found.t)) % 100 == 99
        return Found(found.t, np.where(lost, -1, found.triangle))


def test_lost_rays_are_counted(rng):
    results = [{"case": "closed", "rows": closed({"ours": partial(Careless, F24)}, rng, 3)}]
    assert results[0]["rows"][0]["found"] == {"ours": {"lost": 6}}  # of 642
    assert wrong(results)[0] == "closed, vertices, from middle: 6 lost"


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
@pytest.mark.parametrize("grazing", [1e-1, 1e-2, 1e-3])
def test_wrong_decisions_are_within_the_bound(fmt, grazing, rng):
    held, given = decisions(partial(Machine, fmt), fmt, [sliver(rng, grazing) for _ in range(200)])
    assert held["beyond"] == 0
    assert given["false_hits"] + given["false_misses"] > 0
    if fmt.man_bits >= 16:
        assert held["clear"] > 0


def test_a_wrong_decision_beyond_the_bound_is_counted(rng):
    class Blind(Machine):
        def first(self, origins, directions):
            return Found(np.zeros(len(origins)), np.full(len(origins), -1))

    corners = np.array([[-0.5, -0.5, 0], [0.5, -0.5, 0], [0, 0.5, 0]])
    case = corners, np.array([0, 0, 2.0]), np.array([0, 0, -1.0])
    held, given = decisions(partial(Blind, F24), F24, [case])
    assert held == {
        "false_hits": 0,
        "false_misses": 1,
        "clear": 1,
        "beyond": 1,
        "farthest": held["farthest"],
    }
    assert held["farthest"] > 100
    assert given == {"false_hits": 0, "false_misses": 1}


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_the_bound_is_no_wider_than_it_must_be(fmt, rng):
    cases = [near_edge(rng, fmt) for _ in range(400)]
    held, _ = decisions(partial(Machine, fmt), fmt, cases)
    assert held["beyond"] == 0
    assert held["clear"] > 40
    assert 3 <= held["farthest"] <= 100  # 1/40 of it would be too narrow


@pytest.mark.parametrize("fmt", FORMATS, ids=str)
def test_degenerate_cases(fmt, rng):
    rows = degenerate(systems(fmt, False), fmt, rng, 100, 2)
    assert [row["name"] for row in rows if not row["ok"]] == []


def test_ends(rng):
    rows = {row["name"]: row for row in ends(OURS, F24, rng, 2)}
    assert all(row["ok"] for row in rows.values())
    assert rows["coordinates of +-1"]["found"]["ours"] == {"lost": 0, "moved": 0}
    for size in (-61, -54, -46, -30):
        assert rows[f"sphere of 2^{size}"]["found"]["ours"] == {"lost": 0}
    for length in ("1e-18", "1e-6", "1e6", "1e18"):
        assert rows[f"directions of {length}"]["found"]["ours"] == {"lost": 0, "behind": 0}
    assert "vertex 7 is infinite" in rows["a vertex at inf"]["found"]["ours"]["refused"]


def test_peers_lose_rays(rng):
    pytest.importorskip("embreex")
    pytest.importorskip("warp")
    rows = closed(systems(F24, True), rng, 4)
    found = rows[0]["found"]
    assert found["ours"] == {"lost": 0}
    assert found["embree"]["lost"] > found["embree_robust"]["lost"] > 0
    assert found["warp"]["lost"] < 100  # it works


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--cases", "sharp"], ["--cases sharp: no such case", "closed", "motion"]),
        (["--seed", "-1"], ["--seed -1", "from 0 on"]),
        (["--format", "9,30"], ["9,30", "8,23"]),
    ],
)
def test_bad_options_are_one_line(options, words, run):
    code, out, err = run("bkd-sim", "stability", *options)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert all(word in err for word in words), err


def test_why_a_system_refused_is_said():
    found = {"ours": {"refused": "too narrow"}, "warp": {"lost": 3}}
    row = {"name": "a", "cases": 1, "found": found, "shown": [], "verdict": "refused", "ok": True}
    assert caption([{"case": "closed", "rows": [row, row]}]).endswith("ours refused: too narrow.")
    assert caption([]) == ""


def test_peers_that_are_not_there(monkeypatch):
    monkeypatch.setitem(sys.modules, "embreex.rtcore_scene", None)
    monkeypatch.delitem(sys.modules, "sim.study.stability.embree", raising=False)
    with pytest.raises(InputError, match=r"pip install 'bkdtree\[peers\]'"):
        systems(F24, True)


@pytest.mark.slow
def test_command(tmp_path, monkeypatch, capsys):
    file = tmp_path / "s.json"
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path))
    arguments = ["stability", "--cases", "degenerate", "slivers", "--json", str(file)]
    monkeypatch.setattr(sys, "argv", ["bkd-sim", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert "0 beyond" in text
    assert max(map(len, text.splitlines())) <= 80
    written = json.loads(file.read_text())
    assert [of["case"] for of in written["cases"]] == ["degenerate", "slivers"]
    assert written["provenance"]["seed"] == 1
