"""bkd-fpga formats: the file that bkd-sim precision reads."""

import json

import pytest

from fpga.cli import formats
from hdl.config import TINY
from sim.study.hardware import read_hardware


@pytest.fixture
def measured(monkeypatch):
    """Tools that take no time: as many LUTs as a format has bits, tenfold for a Virtex-4."""

    def resources(config, family, step):
        step("mapping")
        assert config.packets == TINY.packets
        each = {"ecp5": 1, "xc4v": 10}[family]
        return {"core": {"LUT": each * config.fmt.bits, "multipliers": each}}

    def timing(config, unit, seed, step):
        return {"fmax_mhz": 100.0 - config.fmt.bits}

    monkeypatch.setattr(formats, "resources", resources)
    monkeypatch.setattr(formats, "timing", timing)


def test_its_file_is_what_precision_reads(measured, run, tmp_path):
    file = tmp_path / "hardware.json"
    chosen = ["--formats", "3,2", "5,10", "--clock", "5,10", "7,16", "--json", file]
    code, out, err = run("bkd-fpga", "formats", "-c", "tiny", *chosen)
    assert (code, err) == (0, "") and max(map(len, out.split("\n"))) <= 80
    hardware = read_hardware(file)
    assert set(hardware.formats) == {"3,2", "5,10", "7,16"} and hardware.clock_mhz == 76.0
    assert hardware.figures("5,10") == {
        "ecp5_lut": 16, "ecp5_multipliers": 1, "xc4v_lut": 160, "xc4v_multipliers": 10,
        "clock_mhz": 84.0, "clock_measured": True,
    }  # fmt: skip
    assert hardware.figures("3,2")["clock_mhz"] == 76.0
    assert json.loads(file.read_text())["command"].startswith("bkd-fpga formats")


@pytest.mark.parametrize("bad", ["7", "0,3", "11,3"])
def test_no_format(bad, measured, run):
    code, out, err = run("bkd-fpga", "formats", "--formats", bad)
    assert code == 2 and err.count("\n") == 1 and not out
