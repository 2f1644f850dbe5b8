"""fpga.verilog: the files of the command, as they are written."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from fpga import cli
from fpga.cli import verilog as command
from hdl.config import CONFIGS, TINY, Config
from hdl.registers import registers
from hdl.system import System
from sim.cosim.verilate import PortsOnlyVerilator

PORTS = ["clk", "rst", "s_axi_awaddr", "m_axi_awaddr", "m_axi_arlen", "m_axi_rdata", "irq"]


@pytest.fixture(scope="module")
def files(tmp_path_factory) -> dict[str, str]:
    """The files of `tiny`, by suffix; written by a process of its own."""
    return written(tmp_path_factory.mktemp("export"), "1")


def written(folder: Path, hash_seed: str) -> dict[str, str]:
    done = subprocess.run(
        [sys.executable, "-m", "fpga", "verilog", "-c", "tiny", "-o", folder / "x.v"],
        env=os.environ | {"PYTHONHASHSEED": hash_seed},
        cwd=Path(cli.__file__).parents[2],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0 and not done.stderr, done.stderr
    return {suffix: (folder / f"x{suffix}").read_text() for suffix in command.SUFFIXES}


def test_the_same_bytes_whenever(files, tmp_path):
    assert written(tmp_path, "2") == files
    for text in files.values():
        assert not re.search(r"20\d\d-|/home|/tmp|" + re.escape(str(Path.cwd())), text)


def test_every_signal_has_a_plain_name(files):
    text = files[".v"]
    assert "\\" not in text and not re.search(r"\$(?!signed\()", text)
    assert not re.findall(r"\b_\d+_\b", text)


def test_modules_say_what_they_are_and_are_there_once(files):
    flags = re.DOTALL | re.MULTILINE
    modules = re.findall(r"^module (\w+) \(\n(.*?)^endmodule", files[".v"], flags)
    names = [name for name, _ in modules]
    assert names[0] == "bkd_tiny" and len(set(names)) == len(names) < 120
    assert {f"bkd_tiny_{part}" for part in ("core", "traversal", "fetch", "merge3")} <= set(names)
    assert len({body for _, body in modules}) == len(modules)


def test_header_names_parameters_and_ports_are_in_order(files):
    comment, ports = files[".v"].split("module bkd_tiny (")
    assert "fmt = 3,2" in comment and "packets = 3" in comment and "bkdtree" in comment
    assert all(line.startswith("//") for line in comment.strip().split("\n"))
    found = re.findall(r"(?:input|output) \w+ (?:\[\d+:0\] )?(\w+)", ports.split(");")[0])
    assert found[:2] == ["clk", "rst"] and found[-1] == "irq"
    assert [port for port in found if port in PORTS] == PORTS
    assert len(found) == len(list(System(TINY).signature.flatten(System(TINY)))) + 2


def test_lint_is_clean_but_for_waivers_with_a_reason(files, tmp_path):
    PortsOnlyVerilator()  # finds its tools
    for suffix in (".v", ".vlt"):
        (tmp_path / f"x{suffix}").write_text(files[suffix])
    lint = ["verilator", "--lint-only", "-Wall", "--top-module", "bkd_tiny"]
    done = subprocess.run([*lint, "x.vlt", "x.v"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0 and "%" not in done.stderr, done.stderr[:2000]
    lines = files[".vlt"].strip().split("\n")[1:]
    assert all(a.startswith("// ") and b.startswith("lint_off") for a, b in pairs(lines))


def pairs(lines: list[str]):
    return zip(lines[::2], lines[1::2], strict=True)


def test_the_c_header_compiles_and_has_the_map(files, tmp_path):
    (tmp_path / "x.h").write_text(files[".h"])
    checks = [f'_Static_assert(BKD_{r.name} == {r.offset}, "");' for r in registers(TINY)]
    checks += ['_Static_assert(BKD_STATUS_DONE == 2 && BKD_STATUS_OUTCOME == 12, "");']
    checks += ['_Static_assert(BKD_OUTCOME_READ_ERROR == 8 && BKD_VALUE_PACKETS == 3, "");']
    (tmp_path / "x.c").write_text('#include "x.h"\n#include "x.h"\n' + "\n".join(checks) + "\n")
    compiler = ["gcc", "-std=c11", "-Wall", "-Werror", "-fsyntax-only", "x.c"]
    done = subprocess.run(compiler, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_the_register_map_and_the_core_name_all(files):
    for register in registers(TINY):
        assert f"| 0x{register.offset:03X} | `{register.name}` |" in files[".md"]
    core = files[".core"]
    assert core.startswith("CAPI=2:\n") and "toplevel: bkd_tiny" in core
    assert all(f"- x{suffix}:" in core for suffix in (".v", ".h", ".vlt"))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-c", "huge"], ["huge", *CONFIGS]),
        (["-c", "tiny", "-o", "no/such/x.v"], ["no/such/x.v"]),
        (["-c", "tiny", "-o", "x.txt"], ["x.txt", ".v"]),
        (["-c", "banks"], ["banks", "caches"]),
    ],
)
def test_bad_input_is_one_line(arguments, words, run, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    if "banks" in arguments:
        monkeypatch.setitem(CONFIGS, "banks", Config(cache_words=0))
    code, out, err = run("bkd-fpga", "verilog", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert err.startswith("bkd-fpga: ") and all(word in err for word in words)
    assert not list(tmp_path.iterdir()), "nothing half-written"


def test_a_system_needs_caches():
    with pytest.raises(ValueError, match="needs caches"):
        System(Config(cache_words=0))
