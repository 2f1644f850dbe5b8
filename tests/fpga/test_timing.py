"""fpga.timing: the report of place and route, a real run of it, and the command."""

import json

import pytest

from fpga import timing
from fpga.cli import timing as command
from fpga.throughput import throughput
from hdl.config import TINY
from hdl.fp.add import Add

CLOCK = "posedge $glbnet$clk$TRELLIS_IO_IN"


def point(kind: str, delay: float, cell: str) -> dict:
    """A point of a path, as nextpnr writes it."""
    return {"type": kind, "delay": delay, "to": {"cell": cell}}


REPORT = {
    "fmax": {"clk": {"achieved": 91.5, "constraint": 90}},
    "utilization": {
        "TRELLIS_COMB": {"used": 5300, "available": 83640},
        "TRELLIS_FF": {"used": 3545, "available": 83640},
        "DCCA": {"used": 0, "available": 56},
    },
    "critical_paths": [
        {"from": "<async>", "to": CLOCK, "path": [point("setup", 9.0, "rst_TRELLIS_FF_Q")]},
        {
            "from": CLOCK,
            "to": CLOCK,
            "path": [
                point("clk-to-q", 0.5, "unit.issue.node_TRELLIS_FF_Q_14"),
                point("routing", 1.25, "unit.merge2.higher1_y_TRELLIS_FF_Q_DI_LUT4_Z"),
                point(
                    "logic", 0.25, "unit.merge2.higher1_y_TRELLIS_FF_Q_DI_LUT4_Z_D_CCU2C_COUT$CC"
                ),
                point("routing", 1.0, "unit.boxes.copy_1.0.2_DOA3_LUT4_C"),
                point("setup", 0.0, "unit.boxes.copy_1.0.2_DOA3_LUT4_C"),
            ],
        },
    ],
}
PATH = [
    {"name": "issue.node", "logic_ns": 0.5, "routing_ns": 0.0},
    {"name": "merge2.higher1_y", "logic_ns": 0.25, "routing_ns": 1.25},
    {"name": "boxes.copy_1.0.2", "logic_ns": 0.0, "routing_ns": 1.0},
]


@pytest.fixture
def placed(monkeypatch, tmp_path):
    """A place and route that takes no time, and what it was asked."""
    runs = []
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(timing, "_place", lambda text, seed, _: runs.append(seed) or REPORT)
    monkeypatch.setattr(timing, "version", lambda _: "1")
    return runs


def test_the_report_in_names_of_ours():
    found = timing.summary(REPORT)
    assert found["fmax_mhz"] == 91.5 and found["path"] == PATH
    assert found["resources"] == {"TRELLIS_COMB": [5300, 83640], "TRELLIS_FF": [3545, 83640]}


def test_throughput_is_clock_over_cycles():
    update = {"cycles_per_triangle": 2.5, "triangles": 5}
    assert throughput(100, update, {"cycles_per_ray": 8}) == {
        "node_updates_per_second_peak": 100e6,
        "node_updates_per_second": 32e6,
        "updates_per_second_80k": 500,
        "rays_per_second": 12.5e6,
    }


def test_the_command_prints_writes_and_keeps(placed, run, tmp_path):
    files = [tmp_path / name for name in ("t.json", "u.json", "r.json")]
    files[1].write_text(json.dumps({"cycles_per_triangle": 2.5, "triangles": 5}))
    files[2].write_text(json.dumps({"cycles_per_ray": 8}))
    given = [
        x for pair in zip(("--json", "--update", "--render"), files, strict=True) for x in pair
    ]
    for _ in range(2):
        code, out, _ = run("bkd-fpga", "timing", "-c", "tiny", *given)
        assert code == 0 and max(map(len, out.split("\n"))) <= 80
    assert placed == [1]
    assert all(
        word in out for word in ("91.5 MHz", "seed 1", "merge2.higher1_y", "2 M to 8 M", "ECP5")
    )
    figures = json.loads(files[0].read_text())
    assert (figures["unit"], figures["seed"], figures["path"]) == ("core", 1, PATH)
    assert figures["throughput"]["rays_per_second"] == 91.5e6 / 8
    run("bkd-fpga", "timing", "-c", "tiny", "--seed", 2)
    assert placed == [1, 2]
    run("bkd-fpga", "timing", "-c", "tiny", "--unit", "camera", "--json", files[0])
    assert not json.loads(files[0].read_text())["throughput"]


def test_a_unit_is_placed(monkeypatch, tmp_path):
    """The tools themselves, on one adder: nothing of it is left out."""
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path))
    monkeypatch.setitem(timing.UNITS, "adder", lambda config: Add(config.fmt))
    found = timing.timing(TINY, "adder", seed=1)
    assert found["fmax_mhz"] > 50 and found["path"]
    assert found["resources"]["TRELLIS_FF"][0] > 30


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-c", "huge"], ["huge", "tiny", "small", "full"]),
        (["--unit", "gpu"], ["gpu", "core", "update"]),
        (["--json", "no/such/r.json"], ["no/such/r.json"]),
        (["--update", "nothing.json"], ["nothing.json", "No such file"]),
        (["--render", __file__], ["cycles_per_ray", "bkd-sim render"]),
        (["--unit", "update", "--render", "r.json"], ["--render", "update alone", "--unit core"]),
        (["--unit", "rays", "--update", "u.json"], ["--update", "rays alone", "--unit core"]),
    ],
)
def test_bad_input_is_one_line(arguments, words, placed, run):
    code, out, err = run("bkd-fpga", "timing", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1) and not placed
    assert err.startswith("bkd-fpga: ") and all(word in err for word in words)


def test_table_of_rates_leaves_out_what_was_not_measured():
    assert command._rates(80, throughput(80, None, None)).row_count == 1
