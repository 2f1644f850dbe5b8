"""`bkd-fpga resources`."""

from pathlib import Path

from rich.console import Console

from fpga.families import FAMILIES, RESOURCES
from fpga.resources import resources
from hdl.config import CONFIGS
from sim.command import Parser
from sim.console import print_tables, table
from sim.files import check_writable, write_json

EXAMPLE = "resources -c full --family xc4v"
DEPTH = 2
"""Levels below the core that the table shows; the JSON has all."""


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    add("-c", "--config", choices=CONFIGS, default="full", help="%(choices)s; %(default)s")
    add("--family", choices=FAMILIES, default="ecp5", help="%(choices)s; %(default)s")
    add("--json", metavar="FILE", type=Path, help="write the figures of every unit to FILE")


def run(options) -> int:
    """Count what each unit takes of a device, as Yosys maps it."""
    check_writable(options.json)
    console = Console(stderr=True)
    with console.status("") as status:
        units = resources(CONFIGS[options.config], options.family, status.update)
    family = FAMILIES[options.family]
    shown = table(
        f"{options.config} on {family.device}, LUTs of {family.lut_inputs} inputs",
        (
            ("  " * unit.count(".") + unit.split(".")[-1], *(f"{counts[r]:,}" for r in RESOURCES))
            for unit, counts in units.items()
            if unit.count(".") <= DEPTH
        ),
        header=("", *RESOURCES),
    )
    has, whole = family.device_has, units["core"]
    shown.add_section()
    shown.add_row("the device has", *(f"{has[r]:,}" for r in RESOURCES))
    shown.add_row("the core takes", *(f"{whole[r] / has[r]:.0%}" for r in RESOURCES))
    print_tables(shown)
    figures = {"config": options.config, "family": options.family, "device": family.device}
    write_json(options.json, figures | {"device_has": has, "units": units})
    return 0 if all(whole[r] <= has[r] for r in RESOURCES) else 1
