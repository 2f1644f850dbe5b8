"""fpga.yosys with a Yosys that fails."""

import subprocess
import sys

import pytest

from fpga import yosys

FAKE = """
older = False
def run_pass(command):
    global older
    older |= command == "{older}"
    print(command)
    if command.startswith("tee") and not (older and {mended}):
        print("ERROR: {error}")
        raise SystemExit(1)
"""


@pytest.mark.parametrize(
    ("error", "mended", "code", "runs"),
    [
        ("Assert `x == y' failed in rtlil.cc:1.", True, 0, ["older", "script"]),
        ("Assert `x == y' failed in rtlil.cc:1.", False, 1, ["older", "script", "error"]),
        ("Module `top' not found!", True, 1, ["script", "error"]),
    ],
)
def test_maps_the_older_way_where_an_assertion_fails(tmp_path, error, mended, code, runs):
    fake = tmp_path / "pyosys"
    fake.mkdir()
    (fake / "__init__.py").touch()
    text = FAKE.format(older=yosys.OLDER_MAPPING, error=error, mended=mended)
    (fake / "libyosys.py").write_text(text)
    done = subprocess.run(
        [sys.executable, yosys.__file__, "-q", "-l", "a.log", "run.ys"],
        env={"PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    said = {"older": yosys.OLDER_MAPPING, "script": "tee -o a.log script run.ys"}
    said["error"] = f"ERROR: {error}"
    assert done.stdout.splitlines() == [said[name] for name in runs]
    assert done.returncode == code
