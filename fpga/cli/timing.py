"""`bkd-fpga timing`."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from fpga.throughput import BOARD_2006, figures_of, throughput
from fpga.timing import AIM, DEVICE, GRADE, UNITS, timing
from sim.command import Parser
from sim.configuration import config_argument, config_name, read_config
from sim.console import print_tables, table
from sim.errors import InputError
from sim.files import check_writable, write_json

EXAMPLE = "timing -c full --unit update"
UPDATES = ("core", "update")
"""Units that update trees."""

TITLES = {
    "node_updates_per_second_peak": "node updates a second, at most",
    "node_updates_per_second": "node updates a second",
    "updates_per_second_80k": "updates a second of 80,000 triangles",
    "rays_per_second": "rays a second",
}


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    config_argument(parser)
    add("--unit", choices=UNITS, default="core", help="%(choices)s; %(default)s")
    add("--seed", metavar="N", type=int, default=1, help="of place and route; %(default)s")
    text = "what bkd-sim %s --json wrote: adds what this clock makes of its cycles"
    add("--update", metavar="FILE", type=Path, help=text % "update")
    add("--render", metavar="FILE", type=Path, help=text % "render")
    add("--json", metavar="FILE", type=Path, help="write the figures to FILE")


def run(options) -> int:
    """Place and route a unit for an ECP5: its clock, and what limits it."""
    check_writable(options.json)
    config, name, unit = read_config(options.config), config_name(options.config), options.unit
    if not getattr(config, unit, True):
        raise InputError(f"--unit {unit}: {name} has none; use a configuration with {unit} true")
    for option, does, units in (
        ("update", "updates trees", UPDATES),
        ("render", "casts rays", ("core",)),
    ):
        if option == "update" and options.update and not config.update:
            raise InputError(f"--update: {name} updates no tree; leave it out")
        if getattr(options, option) and unit not in units:
            raise InputError(f"--{option}: {unit} alone is not what {does}; take --unit {units[0]}")
    update = figures_of(options.update, "update", "cycles_per_triangle")
    render = figures_of(options.render, "render", "cycles_per_ray")
    with Console(stderr=True).status("") as status:
        found = timing(config, unit, options.seed, status.update)
    rates = throughput(found["fmax_mhz"], update, render) if unit in UPDATES else {}
    print_tables(
        _summary(f"{unit} of {name}", found, options.seed),
        _path(found["path"]),
        *([_rates(found["fmax_mhz"], rates)] if update or render else []),
    )
    about = {"config": name, "unit": unit, "device": DEVICE, "speed_grade": GRADE}
    about |= {"seed": options.seed, "aim_mhz": AIM} | found
    write_json(options.json, about | {"throughput": rates, "board_2006": BOARD_2006})
    return 0


def _summary(name: str, found: dict, seed: int) -> Table:
    rows = [("clock", f"{found['fmax_mhz']:.1f} MHz")]
    for cell, (used, there) in found["resources"].items():
        rows.append((cell, f"{used:,} of {there:,}, {used / there:.0%}"))
    return table(f"{name} alone on an {DEVICE}, speed grade {GRADE}, seed {seed}", rows)


def _path(points: list[dict]) -> Table:
    whole = {key: sum(p[key] for p in points) for key in ("logic_ns", "routing_ns")}
    rows = [
        (point["name"], f"{point['logic_ns']:.2f}", f"{point['routing_ns']:.2f}")
        for point in [*points, {"name": "in all, ns", **whole}]
    ]
    title = "The critical path, from register to register"
    return table(title, rows, header=("signal", "logic", "routing"))


def _rates(mhz: float, rates: dict[str, float]) -> Table:
    rows = []
    for key, rate in rates.items():
        there = BOARD_2006.get(key, ())
        shown = " to ".join(map(_number, there if isinstance(there, tuple) else (there,)))
        rows.append((TITLES[key], _number(rate), shown))
    title = f"At {mhz:.1f} MHz, the clock of an ECP5"
    return table(title, rows, header=("", "here", "the 2006 board"))


def _number(x: float) -> str:
    return f"{x / 1e6:.3g} M" if x >= 1e6 else f"{x:,.0f}"
