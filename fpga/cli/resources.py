"""`bkd-fpga resources`."""

from collections.abc import Iterable
from pathlib import Path

from rich.console import Console
from rich.table import Table

from fpga.families import FAMILIES, RESOURCES, Family
from fpga.resources import ratios, resources
from sim.command import Parser
from sim.configuration import config_argument, config_name, read_config
from sim.console import print_tables, table
from sim.files import check_writable, write_json

EXAMPLE = "resources -c full --family xc4v"
DEPTH = 2
"""Levels below the core that the table shows; the JSON has all."""

Counts = dict[str, dict[str, int]]


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    config_argument(parser)
    add("--against", metavar="CONFIG", help="another configuration, to compare with")
    add("--family", choices=FAMILIES, default="ecp5", help="%(choices)s; %(default)s")
    add("--json", metavar="FILE", type=Path, help="write the figures of every unit to FILE")


def run(options) -> int:
    """Count what each unit takes of a device, as Yosys maps it; of two machines, side by side."""
    check_writable(options.json)
    chosen = {"config": options.config, "against": options.against}
    chosen = {key: text for key, text in chosen.items() if text}
    configs = {key: read_config(text) for key, text in chosen.items()}
    names = {key: config_name(text) for key, text in chosen.items()}
    family = FAMILIES[options.family]
    counts: dict[str, Counts] = {}
    with Console(stderr=True).status("") as status:
        for key, config in configs.items():

            def step(what: str, of: str = names[key]):
                status.update(f"{of}: {what}")

            counts[key] = resources(config, options.family, step)
    units, whole = counts["config"], counts["config"]["core"]
    figures = {**names, "family": options.family, "device": family.device}
    figures |= {"device_has": family.device_has, "units": units}
    if options.against:
        against = counts["against"]
        print_tables(*_compared(names, family, units, against))
        figures |= {"against_units": against, "ratios": ratios(units, against)}
    else:
        print_tables(_table(names["config"], family, units))
    write_json(options.json, figures)
    return 0 if all(whole[r] <= family.device_has[r] for r in RESOURCES) else 1


def _table(name: str, family: Family, units: Counts) -> Table:
    """What each unit takes, and the device has."""
    shown = table(
        f"{name} on {family.device}, LUTs of {family.lut_inputs} inputs",
        ((_label(unit), *(f"{units[unit][r]:,}" for r in RESOURCES)) for unit in _shown(units)),
        header=("", *RESOURCES),
    )
    has, whole = family.device_has, units["core"]
    shown.add_section()
    shown.add_row("the device has", *(f"{has[r]:,}" for r in RESOURCES))
    shown.add_row("the core takes", *(f"{whole[r] / has[r]:.0%}" for r in RESOURCES))
    return shown


def _compared(names: dict[str, str], family: Family, units: Counts, against: Counts) -> list[Table]:
    """A table for each pair of resources: of the one machine, of the other, the one's share."""
    shares = ratios(units, against)
    title = f"{names['config']} against {names['against']} on {family.device}"
    found = []
    for pair in (RESOURCES[:2], RESOURCES[2:]):
        rows = []
        for unit in _shown([*units, *against]):
            row = [_label(unit)]
            for r in pair:
                counts = (of[unit][r] if unit in of else None for of in (units, against))
                row += ["-" if count is None else f"{count:,}" for count in counts]
                share = shares[unit][r]
                row.append("-" if share is None else f"{share:.0%}")
            rows.append(row)
        columns = (column for r in pair for column in (r, "against", "share"))
        found.append(table(title, rows, header=("", *columns)))
    return found


def _shown(units: Iterable[str]) -> list[str]:
    return sorted({unit for unit in units if unit.count(".") <= DEPTH})


def _label(unit: str) -> str:
    return "  " * unit.count(".") + unit.split(".")[-1]
