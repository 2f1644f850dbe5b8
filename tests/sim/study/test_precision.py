"""sim.study.precision and bkd-sim precision."""

import csv
import json

import numpy as np
import pytest
from PIL import Image

from sim.errors import InputError
from sim.study.folder import save
from sim.study.hardware import MEASURED, SIZES, read_hardware
from sim.study.page import picture
from sim.study.precision import updates
from sim.study.precision.conclusion import conclusion
from sim.study.precision.errors import errors, silhouettes
from sim.study.precision.figure import formats_figure
from sim.study.precision.frontier import frontier
from sim.study.precision.measure import measure
from sim.study.precision.report import formats_section, updates_section
from sim.study.precision.rows import COLUMNS, rows_of
from sim.study.provenance import provenance


def test_errors_of_an_image():
    truth = np.array([[0, 1, 2], [3, -1, -1]])
    true_t = np.where(truth < 0, np.inf, 2.0)
    found = np.array([[0, 1, 1], [-1, 5, -1]])
    found_t = np.array([[2.0, 2.5, 9.0], [0.0, 1.0, 0.0]])
    edges = np.array([[False, False, False], [True, True, False]])
    figures = errors(found, found_t, truth, true_t, edges)
    assert figures == {
        "pixels": 6,
        "edge_pixels": 2,
        "wrong": 3 / 6,
        "silhouette": 2 / 6,
        "inside": 1 / 6,
        "lost": 1,
        "false": 1,
        "t_median": pytest.approx(0.125),
        "t_99": pytest.approx(0.2475),
        "t_max": pytest.approx(0.25),
    }


def test_an_image_without_hits_has_no_error_of_t():
    nothing, t = np.full((2, 2), -1), np.zeros((2, 2))
    figures = errors(nothing, t, nothing, t, nothing > 0)
    assert figures["wrong"] == 0
    assert figures["t_median"] is figures["t_99"] is figures["t_max"] is None


def test_silhouettes_are_where_hits_end():
    triangle = np.full((5, 6), -1)
    triangle[:, :3] = 0
    found = silhouettes(triangle, np.where(triangle < 0, np.nan, 1.0), pixel=0.01)
    assert found.tolist() == [[False, False, True, True, False, False]] * 5
    assert not silhouettes(np.full((5, 6), -1), np.zeros((5, 6)), 0.01).any()


def test_silhouettes_are_where_depth_jumps_and_not_where_it_slopes():
    triangle, x = np.zeros((4, 8), int), np.broadcast_to(np.arange(8.0), (4, 8))
    assert not silhouettes(triangle, 1 + 0.07 * x, pixel=0.01).any()
    jump = silhouettes(triangle, np.where(x < 4, 1.0, 1.2), pixel=0.01)
    assert jump.tolist() == [[False] * 3 + [True] * 2 + [False] * 3] * 4


def test_no_point_of_the_frontier_is_beaten():
    points = [(3, 1), (1, 3), (2, 2), (2, 3), (3, 3), (1, 3), (4, 1)]
    assert frontier(points) == [1, 5, 2, 0]
    assert frontier([(1, 0)]) == [0]


def hardware_file(folder, **changes):
    file = folder / "hardware.json"
    whole = {"command": "c", "clock_mhz": 50, "formats": {"5,10": {"ecp5": {"lut": 7}}}, **changes}
    file.write_text(json.dumps(whole))
    return file


def test_hardware_that_is_known_in_part(tmp_path):
    hardware = read_hardware(hardware_file(tmp_path))
    known, unknown = hardware.figures("5,10"), hardware.figures("8,23")
    assert (known["ecp5_lut"], known["xc4v_lut"]) == (7, None)
    assert (known["clock_mhz"], known["clock_measured"]) == (50, False)
    assert [unknown[name] for name in SIZES] == [None] * 4
    own = {"7,16": {"ecp5": {"lut": None, "clock_mhz": 60}, "xc4v": None}}
    figures = read_hardware(hardware_file(tmp_path, formats=own)).figures("7,16")
    assert (figures["clock_mhz"], figures["clock_measured"]) == (60, True)


def test_the_hardware_that_comes_along_can_be_read():
    assert read_hardware(MEASURED).figures("7,16")["clock_measured"]


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"formats": {"7;16": {}}}, "7;16"),
        ({"formats": {"7,16": {"ecp5": {"lut": -3}}}}, "ecp5_lut of 7,16"),
        ({"formats": {"7,16": 3}}, "sizes and clocks"),
        ({"clock_mhz": None}, "sizes and clocks"),
    ],
)
def test_hardware_that_is_none(changes, word, tmp_path):
    with pytest.raises(InputError, match=word):
        read_hardware(hardware_file(tmp_path, **changes))


def result(wrong: float, cycles: int) -> dict:
    return {
        "triangles": 10,
        "pixels": 10_000,
        "edge_pixels": 100,
        "wrong": wrong,
        "silhouette": wrong / 4,
        "inside": 3 * wrong / 4,
        "lost": int(wrong * 100),
        "false": 0,
        "t_median": wrong / 1e3,
        "t_99": wrong / 1e2,
        "t_max": wrong / 10,
        "update_cycles": 1000,
        "ray_cycles": cycles - 1000,
        "cycles": cycles,
        "cycles_per_ray": (cycles - 1000) / 10_000,
        "steps_per_packet": cycles / 10_000,
        "overflow": [],
        "mismatches": 0,
        "mismatches_shown": [],
    }


RESULTS = {
    "4,9": {"refused": "format 4,9 is too <narrow>"},
    "5,12": result(0.02, 300_000),
    "7,16": result(0.0005, 120_000),
    "8,23": result(0.0, 100_000),
}


@pytest.fixture
def rows(tmp_path):
    cells = [{"scene": "s", "frame": 3, "format": text} for text in RESULTS]
    sizes = {"7,16": {"ecp5": {"lut": 50_000, "multipliers": 41, "clock_mhz": 85.0}}}
    hardware = read_hardware(hardware_file(tmp_path, clock_mhz=85.0, formats=sizes))
    return rows_of({"s": "ball"}, cells, list(RESULTS.values()), hardware)


def test_rows_have_the_time_of_their_clock(rows):
    assert "milliseconds" not in rows[0]
    assert rows[2]["milliseconds"] == pytest.approx(120_000 / rows[2]["clock_mhz"] / 1000)
    assert [row["word_bits"] for row in rows] == [128, 128, 128, 256]


def test_the_conclusion_says_what_is_enough_and_what_it_costs(rows):
    text = conclusion(rows)
    assert text.startswith("ball, frame 3: ")
    assert "less than 1 % of 10,000 pixels wrong: 7,16 (24 bits)" in text
    assert "less than 0.1 %: 7,16" in text
    assert "0.01 %" not in text, "a pixel of 10,000: nothing is known of that"
    assert "0.50 times the bits of a memory word" in text
    assert "5,12 (18 bits) takes 3.0 times as long as 8,23" in text
    assert conclusion(rows[:1]) == "ball: no format holds it."


def test_a_picture_is_the_same_each_time(rows):
    first, second = (picture(formats_figure(rows), "svg", "it") for _ in range(2))
    assert first == second
    for label in ("frontier", "milliseconds"):
        assert f"<!-- {label}".encode() in first, "text is drawn as curves, named in comments"


def policy(name: str, **figures) -> dict:
    numbers = {"update_cycles": 500, "render_cycles": 9500, "cycles": 10_000, "lost": 0}
    numbers |= {"different_share": 0.0, "mismatches": 0} | figures
    return {"scene": "ball", "policy": name, "frames": [0, 1], **numbers}


def test_policies_that_lose_hits_are_not_the_cheapest():
    rows = [
        policy("every"),
        policy("every-2", update_cycles=250, cycles=9750),
        policy("stale-2", update_cycles=250, render_cycles=9000, cycles=9250, lost=3),
        {"scene": "ball", "policy": "odd", "frames": [0, 1], "refused": "no"},
    ]
    section = updates_section("updates", rows)
    assert "every-2 takes 0.975 times" in section.conclusion
    assert "lost by stale-2 (3)" in section.conclusion
    assert section.notes == ["odd refused: no"]
    assert [cells[4] for cells in section.tables[0].cells] == ["1.000", "0.975", "0.925"]


def test_files_hold_all_and_need_no_network(rows, tmp_path):
    folder = tmp_path / "out"
    sections = [formats_section("precision", rows), updates_section("updates", [policy("every")])]
    figures = {"provenance": provenance(seed=7), "formats": rows}
    tables = {"precision": (COLUMNS, rows)}
    save(folder, "precision", "Errors", sections, "what it means", tables, figures)
    pictures = [f"{name}.{kind}" for name in ("precision", "updates") for kind in ("png", "svg")]
    names = sorted([*pictures, "index.html", "precision.csv", "precision.json"])
    assert sorted(file.name for file in folder.iterdir()) == names
    page = (folder / "index.html").read_text()
    assert "http" not in page and 'src="data:' in page
    assert "too &lt;narrow&gt;" in page and "too <narrow>" not in page
    with (folder / "precision.csv").open() as file:
        made = file.readline()
        read = list(csv.DictReader(file))
    for told in ("seed 7", "sources ", "python 3", "numpy ", "verilator "):
        assert made.startswith("# ") and told in made and told.strip() in page
    with Image.open(folder / "precision.png") as drawn:
        assert drawn.info["Description"] == made[2:-1]
    assert made[2:-1] in (folder / "precision.svg").read_text()
    assert [row["wrong"] for row in read] == ["", "0.02", "0.0005", "0.0"]
    assert json.loads((folder / "precision.json").read_text())["formats"][1]["lost"] == 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--formats", "7,16", "4;9"], ["4;9", "7,16"]),
        (["--formats", "5,20"], ["5,20"]),
        (["none.npz"], ["none.npz", "no such file"]),
        (["walker:500", "--frame", "99"], ["--frame 99", "0 to 23"]),
        (["walker:500", "--size", "big"], ["--size big"]),
        (["walker:500", "--hardware", "no.json"], ["no.json"]),
        (["walker:500", "--out", "no/such"], ["--out no/such"]),
        (["waves:500", "walker:500", "--only", "none"], ["--only", "formats"]),
    ],
)
def test_bad_input_is_one_line_and_no_file(arguments, words, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, said = run("bkd-sim", "precision", *arguments)
    assert (code, out, said.count("\n")) == (2, "", 1)
    assert all(word in said for word in words), said
    assert not list(tmp_path.iterdir())


def test_a_format_is_refused_that_does_not_reach_a_pixel_s_step():
    with pytest.raises(InputError, match="format 4,9 is too narrow: a pixel's step"):
        measure({"scene": "walker:500", "format": "4,9", "frame": 3, "width": 96, "height": 72})


@pytest.mark.slow
def test_the_command_measures_formats_and_updates(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    small = {"FRAMES": 3, "WIDTH": 48, "HEIGHT": 36, "POLICIES": ("every", "every-2", "stale-2")}
    for name, value in small.items():
        monkeypatch.setattr(updates, name, value)
    command = ["precision", "walker:500", "--formats", "4,9", "7,16", "--size", "96x72"]
    code, out, said = run("bkd-sim", *command)
    assert code == 0, said
    assert max(map(len, out.splitlines())) <= 80
    folder = tmp_path / "precision-walker-500"
    read = json.loads((folder / "precision.json").read_text())
    narrow, ours = read["formats"]
    assert "too narrow" in narrow["refused"]
    assert ours["mismatches"] == 0 and ours["update_cycles"] > 500
    assert 0 < ours["wrong"] < 0.002 and ours["t_median"] < 2.0**-15
    assert [row["policy"] for row in read["updates"]] == list(small["POLICIES"])
    assert [row["lost"] for row in read["updates"][:2]] == [0, 0]
    assert [row["mismatches"] for row in read["updates"]] == [0, 0, 0]
    assert (folder / "precision.png").exists() and (folder / "updates.svg").exists()
