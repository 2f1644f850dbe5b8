"""Runs the tools that synthesise, and keeps what takes minutes."""

import hashlib
import importlib.metadata
import json
import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from filelock import FileLock
from platformdirs import user_cache_path

YOSYS = "import sys; from pyosys import libyosys; libyosys.run_pass('script ' + sys.argv[1])"


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
    folder = Path(os.environ.get("BKDTREE_CACHE", user_cache_path("bkdtree")))
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"{kind}-{key}.json"
    with FileLock(file.with_suffix(".lock")):
        if not file.exists():
            new = file.with_suffix(f".{os.getpid()}")
            new.write_text(json.dumps(make()))
            new.replace(file)
    return json.loads(file.read_text())


def run_yosys(commands: Sequence[str], folder: Path):
    """Run Yosys commands in a folder.

    Raises
    ------
    BuildError
        Yosys is missing, or fails.
    """
    version("pyosys")
    (folder / "run.ys").write_text("\n".join(commands) + "\n")
    run_tool([sys.executable, "-c", YOSYS, "run.ys"], folder, "Yosys")


def run_tool(command: Sequence[str], folder: Path, name: str):
    """Run a tool in a folder; if it fails, say the last thing that it said.

    Raises
    ------
    BuildError
        It fails.
    """
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        said = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
        raise BuildError(f"{name} failed: {said[-1]}")
