"""The command `bkd-fpga`: what a device takes."""

import argparse
import json
import os
import sys
import tempfile
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from fpga.families import FAMILIES, RESOURCES
from fpga.resources import BuildError, resources
from hdl.config import CONFIGS

DEPTH = 2
"""Levels below the core that the table shows; the JSON has all."""


class UsageError(Exception):
    """An option that a user can mend."""


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message):
        raise UsageError(f"{message}; see {self.prog} --help")


def parser() -> Parser:
    """All commands and their options."""
    top = Parser(prog="bkd-fpga", description="Build a B-KD tree machine for FPGAs.")
    top.epilog = "Example: bkd-fpga resources -c full --family xc4v"
    commands = top.add_subparsers(metavar="COMMAND", required=True, parser_class=Parser)
    text = (run_resources.__doc__ or "").split("\n")[0]
    sub = commands.add_parser("resources", help=text, description=text, epilog=top.epilog)
    add = sub.add_argument
    add("-c", "--config", choices=CONFIGS, default="full", help="%(choices)s; %(default)s")
    add("--family", choices=FAMILIES, default="ecp5", help="%(choices)s; %(default)s")
    add("--json", metavar="FILE", type=Path, help="write the figures of every unit to FILE")
    sub.set_defaults(run=run_resources)
    return top


def run_resources(options) -> int:
    """Count what each unit takes of a device, as Yosys maps it."""
    if options.json and not os.access(options.json.absolute().parent, os.W_OK):
        raise UsageError(f"{options.json}: cannot be written; name a file in a folder that exists")
    console = Console(stderr=True)
    with console.status("") as status:
        units = resources(CONFIGS[options.config], options.family, status.update)
    family = FAMILIES[options.family]
    table = Table(
        title=f"{options.config} on {family.device}, LUTs of {family.lut_inputs} inputs",
        title_justify="left",
        box=box.SIMPLE,
    )
    table.add_column("")
    for name in RESOURCES:
        table.add_column(name, justify="right")
    for unit, counts in units.items():
        if unit.count(".") <= DEPTH:
            indent = "  " * unit.count(".")
            name = f"{indent}{unit.split('.')[-1]}"
            table.add_row(name, *(f"{counts[resource]:,}" for resource in RESOURCES))
    has, whole = family.device_has, units["core"]
    table.add_section()
    table.add_row("the device has", *(f"{has[r]:,}" for r in RESOURCES))
    table.add_row("the core takes", *(f"{whole[r] / has[r]:.0%}" for r in RESOURCES))
    Console(highlight=False).print(table, width=80)
    if options.json:
        figures = {"config": options.config, "family": options.family, "device": family.device}
        figures |= {"device_has": has, "units": units}
        with tempfile.TemporaryDirectory(dir=options.json.absolute().parent) as folder:
            temporary = Path(folder) / options.json.name
            temporary.write_text(json.dumps(figures, indent=1) + "\n")
            temporary.replace(options.json)
    return 0 if all(whole[r] <= has[r] for r in RESOURCES) else 1


def main():
    """Run the command; errors that a user can mend are one line, and exit code 2."""
    try:
        options = parser().parse_args()
        sys.exit(options.run(options))
    except (UsageError, BuildError) as error:
        print(f"bkd-fpga: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
