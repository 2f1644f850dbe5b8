"""Building simulators: what it takes of a machine, and what it says where that is missing."""

import os
from pathlib import Path

import pytest

from hdl.fp.format import FloatFormat
from hdl.update.merge import Merge3
from sim.cosim.verilate import SimulationError, build, simulator

pytestmark = pytest.mark.skipif(simulator() == "icarus", reason="compiles nothing")


@pytest.fixture
def shadowed(tmp_path, monkeypatch):
    """Puts a command that fails, with a word on why, before the real one of that name."""
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path / "cache"))

    def shadow(name: str, message: str):
        folder = tmp_path / "shadow"
        folder.mkdir()
        (folder / name).write_text(f"#!/bin/sh\necho '{message}' >&2\nexit 127\n")
        (folder / name).chmod(0o755)
        monkeypatch.setenv("PATH", os.pathsep.join([str(folder), os.environ["PATH"]]))

    return shadow


def test_it_asks_for_no_python(shadowed):
    """A bare machine has a python3 and no python."""
    shadowed("python", "python: not found")
    folder = build(Merge3(FloatFormat(3, 2)))
    assert (Path(folder) / "dut").exists()


def test_what_fails_is_named(shadowed):
    shadowed("g++", "g++: out of luck: not found")
    with pytest.raises(SimulationError, match="does not build: g.*out of luck"):
        build(Merge3(FloatFormat(3, 2)))


def test_the_runtime_is_compiled_once(tmp_path, monkeypatch):
    """The second simulator takes that of the first, as it is: here with nothing in it."""
    monkeypatch.setenv("BKDTREE_CACHE", str(tmp_path))
    build(Merge3(FloatFormat(3, 2)))
    (runtime,) = tmp_path.glob("runtime-*")
    assert len(parts := list(runtime.glob("*.o"))) >= 2
    for part in parts:
        part.write_bytes(b"")
    with pytest.raises(SimulationError, match="does not build"):
        build(Merge3(FloatFormat(3, 3)))
