"""fpga.resources: counts by unit, and the command."""

import json
from dataclasses import replace

import pytest

from fpga import resources
from fpga.families import FAMILIES, RESOURCES
from hdl.config import TINY
from sim.configuration import write_config

CELLS = {
    "update": "$scopeinfo",
    "update.merge": "$scopeinfo",
    "updated": "$scopeinfo",
    "busy_LUT4_Z": "LUT4",
    "GSR": "GSR",
    "update.o__p.x_LUT4_Z": "LUT4",
    "update.sum_CCU2C_S0": "CCU2C",
    "update.merge.product": "MULT18X18D",
    "update.merge.kept.0.0": "DP16KD",
    "update.merge.kept.1.0": "TRELLIS_DPR16X4",
    "updated.x_TRELLIS_FF_Q": "TRELLIS_FF",
}
COUNTS = {
    "core": (1 + 1 + 2 + 6, 1, 1, 1),
    "core.update": (1 + 2 + 6, 0, 1, 1),
    "core.update.merge": (6, 0, 1, 1),
    "core.updated": (0, 1, 0, 0),
}


@pytest.fixture
def synthesised(monkeypatch, tmp_path):
    """A synthesis that takes no time, and its number of runs."""
    runs = []
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(resources, "_synthesise", lambda *a: runs.append(a) or CELLS)
    monkeypatch.setattr(resources, "_verilog", repr)
    monkeypatch.setattr(resources, "version", lambda _: "1")
    return runs


def test_units_hold_all_below_them():
    found = resources._by_unit(resources._by_owner(CELLS), FAMILIES["ecp5"])
    assert found == {
        name: dict(zip(RESOURCES, counts, strict=True)) for name, counts in COUNTS.items()
    }


def test_a_result_is_kept(synthesised):
    first = resources.resources(TINY, "ecp5")
    assert resources.resources(TINY, "ecp5") == first and len(synthesised) == 1
    assert resources.resources(TINY, "xc4v") != first and len(synthesised) == 2


def test_the_command_prints_and_writes(synthesised, run, tmp_path):
    file = tmp_path / "r.json"
    code, out, _ = run("bkd-fpga", "resources", "-c", "tiny", "--json", file)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    assert "10" in out and "83,640" in out and "0%" in out
    figures = json.loads(file.read_text())
    assert figures["units"]["core"]["LUT"] == 10 and figures["device"] == "ECP5-85F"


def test_two_machines_side_by_side(synthesised, run, monkeypatch, tmp_path):
    """What one of them has not is a dash."""
    file, still = tmp_path / "r.json", tmp_path / "still.json"
    write_config(still, replace(TINY, update=False), {})
    few = {name: kind for name, kind in CELLS.items() if not name.startswith("update.")}
    few = {name: kind for name, kind in few.items() if name != "update"}
    monkeypatch.setattr(
        resources, "_synthesise", lambda text, _: few if "update=False" in text else CELLS
    )
    arguments = ["-c", still, "--against", "tiny", "--json", file]
    code, out, _ = run("bkd-fpga", "resources", *arguments)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    row = next(line.split() for line in out.split("\n") if line.split()[:1] == ["update"])
    assert row == ["update", "-", "9", "-", "-", "0", "-"]
    core = next(line.split() for line in out.split("\n") if line.split()[:1] == ["core"])
    assert core == ["core", "1", "10", "10%", "1", "1", "100%"]
    figures = json.loads(file.read_text())
    assert (figures["config"], figures["against"]) == ("still", "tiny")
    assert (
        figures["ratios"]["core"]["LUT"] == 0.1 and figures["ratios"]["core.update"]["LUT"] is None
    )
    assert "core.update" in figures["against_units"] and "core.update" not in figures["units"]


def test_a_core_that_does_not_fit_fails(synthesised, run, monkeypatch):
    many = CELLS | {f"x_{k}": "LUT4" for k in range(90_000)}
    monkeypatch.setattr(resources, "_synthesise", lambda *_: many)
    code, out, _ = run("bkd-fpga", "resources", "-c", "tiny")
    assert code == 1 and "108%" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-c", "huge"], ["huge", "tiny", "small", "full"]),
        (["--against", "huge"], ["huge", "tiny", "small", "full"]),
        (["--family", "xc9"], ["xc9", "xc4v", "ecp5"]),
        (["--json", "no/such/r.json"], ["no/such/r.json"]),
    ],
)
def test_bad_input_is_one_line(arguments, words, synthesised, run):
    code, out, err = run("bkd-fpga", "resources", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1) and not synthesised
    assert err.startswith("bkd-fpga: ") and all(word in err for word in words)
