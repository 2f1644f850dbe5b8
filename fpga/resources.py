"""What a core takes of a device, unit by unit, as Yosys counts."""

import json
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from amaranth.back import verilog

from fpga.families import FAMILIES, RESOURCES, Family
from fpga.tools import kept, run_yosys, version
from hdl.config import Config
from hdl.core import Core

TOP = "core"


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

    def make() -> dict:
        step(f"mapping to {chosen.device}")
        return _synthesise(text, chosen)

    modules = kept("resources", [text, repr(chosen), version("pyosys")], make)
    return _by_unit(modules, chosen)


def _verilog(config: Config) -> str:
    return verilog.convert(Core(config), name=TOP, emit_src=False)


def _synthesise(text: str, family: Family) -> dict[str, dict[str, int]]:
    """Cells of each module that are no modules themselves, by name."""
    with tempfile.TemporaryDirectory(prefix="bkdtree-") as folder:
        (Path(folder) / "core.v").write_text(text)
        run_yosys(
            [
                "read_verilog core.v",
                family.synthesis.format(top=TOP),
                "tee -o stat.json stat -json",
            ],
            Path(folder),
        )
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
