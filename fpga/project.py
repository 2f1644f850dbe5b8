"""A board's design as files for the tools that build it."""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path

from fpga import yosys
from fpga.boards.board import Board, Top
from fpga.boards.pins import comment_missing
from fpga.tools import FOR_SPEED, OPEN_TOOLS

NAME = "top"
BITSTREAM = f"{NAME}.bit"
REPORT = f"{NAME}.report.json"
"""What nextpnr says of timing and resources."""


@dataclass(frozen=True)
class Project:
    """Files, and commands that make a bitstream of them.

    Attributes
    ----------
    digest : str
        Of all that the bitstream depends on but the versions of the tools.
    files : dict of str
        By name.
    commands : list of lists of str
        To be run in their folder, one after the other.
    """

    digest: str
    files: dict[str, str]
    commands: list[list[str]]

    def write(self, folder: Path):
        """Write all files to a folder; what an earlier project came to is taken away first."""
        folder.mkdir(parents=True, exist_ok=True)
        for old in (BITSTREAM, REPORT):
            (folder / old).unlink(missing_ok=True)
        for name, text in self.files.items():
            (folder / name).write_text(text)
        if "yosys" in self.files:
            (folder / "yosys").chmod(0o755)

    def shell_command(self, folder: Path) -> str:
        """What builds in a folder without us."""
        tools = {command[0] for command in self.commands}
        names = {"yosys": "./yosys", **OPEN_TOOLS}
        variables = (
            f"{tool.upper().replace('-', '_')}={name} "
            for tool, name in names.items()
            if tool in tools
        )
        return f"cd {folder} && {''.join(variables)}sh build_{NAME}.sh"

    @property
    def missing_tool(self) -> str | None:
        """A tool that is not there, but for those that come with Python packages."""
        for tool, *_ in self.commands:
            if tool not in OPEN_TOOLS and tool != "yosys" and not shutil.which(tool):
                return tool
        return None


def project(board: Board, pins: dict[str, str], seed: int = 1) -> Project:
    """The project of a board.

    Parameters
    ----------
    board : Board
    pins : dict of str
        That a user has named, for a board that needs it. Those that are missing are comments in
        the constraint file.
    seed : int
        Of the placer, where that is nextpnr.
    """
    options = {
        # router1, its default, takes hours for a memory this large
        "nextpnr_opts": f"--seed {seed} --router router2 {FOR_SPEED} --timing-allow-fail"
        f" --report {REPORT}",
        **board.overrides,
    }
    plan = board.platform(pins).prepare(Top(board), NAME, emit_src=False, **options)
    files = dict(plan.files)
    constraints = f"{NAME}.ucf"
    if constraints in files:
        files[constraints] = comment_missing(files[constraints])
    commands = json.loads(files[f"build_{NAME}.json"])["commands"]
    if commands[0][0] == "yosys":
        files["yosys"] = Path(yosys.__file__).read_text()
    return Project(plan.digest().hex()[:24], files, commands)
