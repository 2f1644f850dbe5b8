"""The command `bkd-fpga`: what a device takes."""

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from fpga.families import FAMILIES, RESOURCES
from fpga.resources import BuildError, resources
from hdl.config import CONFIGS
from sim.command import Parser, run
from sim.console import print_tables
from sim.files import check_writable, write_json

DEPTH = 2
"""Levels below the core that the table shows; the JSON has all."""


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
    check_writable(options.json)
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
    print_tables(table)
    figures = {"config": options.config, "family": options.family, "device": family.device}
    write_json(options.json, figures | {"device_has": has, "units": units})
    return 0 if all(whole[r] <= has[r] for r in RESOURCES) else 1


def main():
    """Run the command."""
    run(parser(), BuildError)
