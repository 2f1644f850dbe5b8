"""What a core takes of a device, unit by unit, as Yosys counts."""

import json
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

from amaranth import Const, Value
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

    The core is mapped as one, so that what units share or do not need is not counted; a cell
    belongs to the unit whose signal it drives. Minutes the first time; kept by content. `step` is
    told what begins.

    Raises
    ------
    BuildError
        Yosys is missing, or fails.
    """
    step("writing Verilog")
    text, chosen = _verilog(config), FAMILIES[family]

    def make() -> dict:
        step(f"mapping to {chosen.device}: minutes for a whole core")
        return _by_owner(_synthesise(text, chosen))

    owned = kept("resources", [text, chosen.synthesis, version("pyosys")], make)
    return _by_unit(owned, chosen)


def ratios(
    units: dict[str, dict[str, int]], against: dict[str, dict[str, int]]
) -> dict[str, dict[str, float | None]]:
    """What each unit takes over what that of another machine takes, by unit and resource.

    None where one of them has no such unit, or the other takes none.
    """
    found = {}
    for unit in sorted({*units, *against}):
        one, other = units.get(unit), against.get(unit)
        found[unit] = {
            r: one[r] / other[r] if one and other and other[r] else None for r in RESOURCES
        }
    return found


def _verilog(config: Config) -> str:
    core = Core(config)
    members = [Value.cast(value) for *_, value in core.signature.flatten(core)]
    ports = [value for value in members if not isinstance(value, Const)]
    return verilog.convert(core, ports=ports, name=TOP, emit_src=False)


def _synthesise(text: str, family: Family) -> dict[str, str]:
    """Type of each cell by its name; the units are cells of type $scopeinfo."""
    with tempfile.TemporaryDirectory(prefix="bkdtree-") as name:
        folder = Path(name)
        (folder / "core.v").write_text(text)
        synthesis = family.synthesis.format(top=TOP)
        run_yosys(["read_verilog core.v", synthesis, "autoname", "write_json core.json"], folder)
        cells = json.loads((folder / "core.json").read_text())["modules"][TOP]["cells"]
    return {cell: found["type"] for cell, found in cells.items()}


def _by_owner(cells: dict[str, str]) -> dict[str, dict[str, int]]:
    """Cells of each unit itself, by type."""
    units = {TOP} | {f"{TOP}.{name}" for name, kind in cells.items() if kind == "$scopeinfo"}
    owned: dict[str, dict[str, int]] = {unit: Counter() for unit in units}
    for name, kind in cells.items():
        owner = f"{TOP}.{name}"
        while owner not in units:
            owner = owner.rpartition(".")[0]
        owned[owner][kind] += kind != "$scopeinfo"
    return owned


def _by_unit(owned: dict[str, dict[str, int]], family: Family) -> dict[str, dict[str, int]]:
    """Count of each of RESOURCES by unit, with all below it."""
    units: dict[str, dict[str, int]] = {unit: dict.fromkeys(RESOURCES, 0) for unit in sorted(owned)}
    for unit, cells in owned.items():
        for cell, count in cells.items():
            if cell in family.cells:
                resource, each = family.cells[cell]
                above = unit
                while above:
                    units[above][resource] += count * each
                    above = above.rpartition(".")[0]
    return units
