"""fpga.resources: counts by unit, and the command."""

import json
import sys

import pytest

from fpga import cli, resources
from fpga.families import FAMILIES, RESOURCES
from hdl.config import TINY

MODULES = {
    "core": {"LUT4": 10, "TRELLIS_FF": 3, "GSR": 1},
    "core.update": {"LUT4": 5, "CCU2C": 2, "MULT18X18D": 1},
    "core.update.merge": {"LUT4": 100, "DP16KD": 4, "TRELLIS_DPR16X4": 3},
    "core.updated": {"TRELLIS_FF": 7},
    "$paramod": {"LUT4": 1000},
}
COUNTS = {
    "core": (10 + 5 + 4 + 100 + 12, 10, 1, 4),
    "core.update": (5 + 4 + 100 + 12, 0, 1, 4),
    "core.update.merge": (112, 0, 0, 4),
    "core.updated": (0, 7, 0, 0),
}


def run(monkeypatch, capsys, *arguments) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command."""
    monkeypatch.setattr(sys, "argv", ["bkd-fpga", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert isinstance(end.value.code, int)
    return (end.value.code, *capsys.readouterr())


@pytest.fixture
def synthesised(monkeypatch, tmp_path):
    """A synthesis that takes no time, and its number of runs."""
    runs = []
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(resources, "_synthesise", lambda *a: runs.append(a) or MODULES)
    monkeypatch.setattr(resources, "_verilog", repr)
    monkeypatch.setattr(resources, "version", lambda _: "1")
    return runs


def test_units_hold_all_below_them():
    found = resources._by_unit(MODULES, FAMILIES["ecp5"])
    assert found == {
        name: dict(zip(RESOURCES, counts, strict=True)) for name, counts in COUNTS.items()
    }


def test_a_result_is_kept(synthesised):
    first = resources.resources(TINY, "ecp5")
    assert resources.resources(TINY, "ecp5") == first and len(synthesised) == 1
    assert resources.resources(TINY, "xc4v") != first and len(synthesised) == 2


def test_the_command_prints_and_writes(synthesised, tmp_path, monkeypatch, capsys):
    file = tmp_path / "r.json"
    code, out, _ = run(monkeypatch, capsys, "resources", "-c", "tiny", "--json", file)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    assert "131" in out and "83,640" in out and "0%" in out
    figures = json.loads(file.read_text())
    assert figures["units"]["core"]["LUT"] == 131 and figures["device"] == "ECP5-85F"


def test_a_core_that_does_not_fit_fails(synthesised, monkeypatch, capsys):
    monkeypatch.setitem(MODULES["core"], "LUT4", 90_000)
    code, out, _ = run(monkeypatch, capsys, "resources", "-c", "tiny")
    assert code == 1 and "108%" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-c", "huge"], ["huge", "tiny", "small", "full"]),
        (["--family", "xc9"], ["xc9", "xc4v", "ecp5"]),
        (["--json", "no/such/r.json"], ["no/such/r.json"]),
    ],
)
def test_bad_input_is_one_line(arguments, words, synthesised, monkeypatch, capsys):
    code, out, err = run(monkeypatch, capsys, "resources", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1) and not synthesised
    assert err.startswith("bkd-fpga: ") and all(word in err for word in words)
