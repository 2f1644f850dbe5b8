"""`bkd-sim analyse`: its table, what follows, its figures and its errors."""

import json

import numpy as np
import pytest

from sim.parts.tables import ROWS


def analyse(run, *arguments) -> str:
    code, out, err = run("bkd-sim", "analyse", *arguments)
    assert (code, err) == (0, "") and max(map(len, out.split("\n"))) <= 80
    return out


def rows(out: str) -> list[list[str]]:
    """Cells of the table's rows."""
    found = [line.split() for line in out.split("\n")]
    return [cells for cells in found if len(cells) > 7 and cells[0].lstrip("+").isdigit()]


def test_the_table_and_its_figures_agree(run, tmp_path):
    file = tmp_path / "room.json"
    out = analyse(run, "room:4000", "--json", file)
    figures = json.loads(file.read_text())
    assert figures["scene"] == "room:4000" and figures["frames"] == list(range(24))
    assert (figures["error"], figures["factor"]) == (2**-18, 2.0)
    table = rows(out)
    assert [row[1] for row in table] == ["static", "structured", "structured", "continuous"]
    for k, (row, part) in enumerate(zip(table, figures["parts"], strict=True)):
        expected = [str(k), part["kind"], str(part["pieces"]), f"{part['triangles']:,}"]
        assert row[:4] == expected and row[7] == part["chosen"]
        assert row[5:7] == [f"{part['words']:.0f}", f"{part['instructions']:,}"]
    assert sum(part["triangles"] for part in figures["parts"]) == figures["triangles"]
    whole, divided = figures["whole"], figures["divided"]
    text = " ".join(out.split("\n")[-3:])
    assert f"whole: {whole['words']:,.0f} words and {whole['instructions']:,} instr" in text
    assert f"divided: {divided['words']:,.0f} words and {divided['instructions']:,} instr" in text


def test_copies_are_named(run):
    table = rows(analyse(run, "fleet:4000"))
    assert [row[7:] for row in table[:3]] == [["nothing"], ["instance"], ["copy", "of", "1"]]


def test_many_parts_are_few_rows(run):
    out = analyse(run, "explosion:2000")
    table = rows(out)
    assert [row[0].isdigit() for row in table] == [True] * ROWS + [False] * 2
    assert [row[1] for row in table[ROWS:]] == ["structured", "continuous"]
    assert sum(int(row[3].replace(",", "")) for row in table) == 1980


def test_what_fails_and_from_when_on(run, tmp_path):
    file = tmp_path / "burst.json"
    text = " ".join(analyse(run, "burst:20k", "--json", file).split())
    (part,) = json.loads(file.read_text())["parts"]
    words = part["rebuild"]["words"]
    assert part["kind"] == "unstructured" and part["fails_from"] == 1
    assert (
        "Part 0: refit fails from frame 1; a rebuild costs 60.1 ms on the host and "
        f"{words:,} words instead." in text
    )


def test_options_count(run, scene_file):
    fox = scene_file("Fox.glb")
    assert rows(analyse(run, fox, "--frames", "3"))[0][1] == "static"
    assert rows(analyse(run, fox, "--error", "1"))[0][1] == "structured"
    assert rows(analyse(run, "burst:2000", "--factor", "100"))[0][1] == "continuous"
    assert "Nothing moves" in analyse(run, scene_file("CornellBox.glb"))


BAD = {
    "scene": (["runner"], ["runner", "walker"]),
    "error": (["walker:500", "--error", "-1"], ["error of -1", "0 or more"]),
    "no error": (["walker:500", "--error", "small"], ["--error", "small"]),
    "factor": (["walker:500", "--factor", "0.5"], ["factor of 0.5", "that or more"]),
    "frames": (["walker:500", "--frames", "20:30"], ["--frames 20:30", "0 to 23"]),
    "folder": (["walker:500", "--json", "no/such/a.json"], ["no/such/a.json", "written"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_no_file(case, run, tmp_path, monkeypatch):
    arguments, words = BAD[case]
    monkeypatch.chdir(tmp_path)
    if "--json" not in arguments:
        arguments = [*arguments, "--json", "a.json"]
    code, out, err = run("bkd-sim", "analyse", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1) and err.startswith("bkd-sim: ")
    assert all(word in err for word in words) and not list(tmp_path.iterdir())


def test_a_vertex_that_is_no_number_is_named(run, tmp_path):
    points = np.random.default_rng(1).normal(size=(3, 4, 3))
    points[2, 1] = np.nan
    np.savez(tmp_path / "a.npz", faces=[[0, 1, 2], [1, 2, 3]], vertices=points)
    code, _, err = run("bkd-sim", "analyse", tmp_path / "a.npz")
    assert (code, err.count("\n")) == (2, 1) and "frame 2" in err and "vertex 1" in err
