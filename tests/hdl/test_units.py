"""Machines that leave units out: all that can be, each against the model, and what is left."""

import json
import re
import subprocess
from dataclasses import replace
from functools import cache
from itertools import product

import pytest

from fpga.tools import run_yosys
from fpga.verilog import export
from hdl.config import Config
from hdl.core import Core
from hdl.fp.format import FloatFormat
from sim.configuration import write_config
from sim.cosim.machine import Machine, Timing
from sim.cosim.verilate import PortsOnlyVerilator
from sim.prepare import prepare
from sim.scene.load import load_scene
from tests.hdl.checked import Checked, random_rays, random_view
from tests.sim.compiler.forests import random_forest

CHOICES = [
    [{}, {"update": False, "pointer_bits": 6}],
    [{}, {"camera": False}, {"source": False}],
    [{}, {"instances": True}],
    [{}, {"folded": True}],
]
SMALL = Config(
    FloatFormat(4, 4), 5, 8, latency=4, address_bits=10, packets=3, stack_depth=16, cache_words=16
)
COMBINATIONS = {
    ",".join(f"{k}={v}" for k, v in changes.items()) or "all": replace(SMALL, **changes)
    for changes in ({k: v for c in chosen for k, v in c.items()} for chosen in product(*CHOICES))
}
QUICK = (
    "camera=False",
    "update=False,pointer_bits=6,source=False,instances=True,folded=True",
)
"""With each choice at least once; the others take half a minute each to build."""

LEFT_BEHIND = {
    "update": r"update|program|fetch|issue|loader|merge|vertex_registers|box_registers",
    "camera": r"camera|image|pixel",
    "source": r"source|rays_address|rays_packets",
    "instances": r"transform|entries|instance|roots",
}


PARAMETERS = [
    pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in COMBINATIONS
]


@pytest.mark.parametrize("name", PARAMETERS)
def test_every_combination_is_the_model_bit_for_bit(name, rng):
    config = COMBINATIONS[name]
    if config.instances:
        prepared = random_forest(rng, config, triangles=20, instances=3)
    else:
        prepared = prepare(load_scene("waves:50"), config)
    with Machine(config, prepared.image.size + 3 * 48, Timing(), unit=Core) as machine:
        checked = Checked(machine, prepared, 48, rng)
        for frame, timing in enumerate((Timing(1), Timing(20, 0.3, 5))):
            machine.reset(timing)
            checked.pose(frame)
            updates = config.update
            if config.source:
                checked.cast(random_rays(rng, config.fmt, 48), updates=updates)
                updates = False
            if config.camera:
                checked.look(random_view(rng, config.fmt, 7, 5), updates=updates)


@pytest.mark.parametrize("name", PARAMETERS)
def test_every_combination_passes_lint_and_yosys(name, tmp_path):
    PortsOnlyVerilator()  # finds its tools
    for suffix, text in export(COMBINATIONS[name], "x", "x").items():
        (tmp_path / f"x{suffix}").write_text(text)
    lint = ["verilator", "--lint-only", "-Wall", "--top-module", "bkd_x", "x.vlt", "x.v"]
    done = subprocess.run(lint, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and "%" not in done.stderr, done.stderr[:2000]
    commands = ["read_verilog x.v", "hierarchy -check -top bkd_x", "proc", "check -assert"]
    run_yosys(commands, tmp_path)


@pytest.mark.parametrize("units", [("update", "camera"), ("source", "instances")])
def test_nothing_of_a_unit_is_left(units):
    """No module, no port, no signal and no register has its name; with it, there are some."""
    whole, less = _exported(), _exported(*units)
    for unit in units:
        names = re.compile(rf"\b\w*({LEFT_BEHIND[unit]})\w*", re.IGNORECASE)
        for suffix in (".v", ".h", ".md"):
            found, left = ({*map(str.lower, _words(of[suffix], names))} for of in (whole, less))
            assert found and not left, (unit, suffix, sorted(left)[:20])


@cache
def _exported(*without: str) -> dict[str, str]:
    """The files of a machine with all units but some."""
    whole = replace(SMALL, instances=True)
    return export(replace(whole, **dict.fromkeys(without, False)), "x", "x")


def _words(text: str, names: re.Pattern) -> list[str]:
    """Identifiers of a file of ours that match, but for comments on what was built."""
    code = re.sub(r"^//.*$|BKD_\w*UNITS\w*|`UNITS`.*$", "", text, flags=re.MULTILINE)
    return [match[0] for match in names.finditer(code)]


def test_a_machine_of_a_file_renders_a_frame(run, tmp_path):
    """Without update processor: any one frame of a scene that moves, with the host's bounds."""
    file, figures = tmp_path / "still.json", tmp_path / "r.json"
    write_config(file, COMBINATIONS[QUICK[1]], {})
    options = ["--frame", "3", "--size", "8x6", "--out", tmp_path / "a.png", "--json", figures]
    code, _, err = run("bkd-sim", "render", "waves:50", "-c", file, *options)
    found = json.loads(figures.read_text())
    assert (code, err, found["model_mismatches"], found["updates"]) == (0, "", 0, 0)
    assert found["format"] == "4,4" and found["rays"] == 48 and found["hit_fraction"] > 0.1
    assert "update" not in found["overflows"] and (tmp_path / "a.png").exists()
