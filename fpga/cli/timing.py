"""`bkd-fpga timing`."""

from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from fpga.throughput import BOARD_2006, figures_of, throughput
from fpga.timing import AIM, DEVICE, GRADE, UNITS, timing
from hdl.config import CONFIGS
from sim.command import Parser
from sim.console import print_tables
from sim.files import check_writable, write_json

EXAMPLE = "timing -c full --unit update"
TITLES = {
    "node_updates_per_second_peak": "node updates a second, at most",
    "node_updates_per_second": "node updates a second",
    "updates_per_second_80k": "updates a second of 80,000 triangles",
    "rays_per_second": "rays a second",
}


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    add("-c", "--config", choices=CONFIGS, default="full", help="%(choices)s; %(default)s")
    add("--unit", choices=UNITS, default="core", help="%(choices)s; %(default)s")
    add("--seed", metavar="N", type=int, default=1, help="of place and route; %(default)s")
    text = "what bkd-sim %s --json wrote: adds what this clock makes of its cycles"
    add("--update", metavar="FILE", type=Path, help=text % "update")
    add("--render", metavar="FILE", type=Path, help=text % "render")
    add("--json", metavar="FILE", type=Path, help="write the figures to FILE")


def run(options) -> int:
    """Place and route a unit for an ECP5: its clock, and what limits it."""
    check_writable(options.json)
    update = figures_of(options.update, "update", "cycles_per_triangle")
    render = figures_of(options.render, "render", "cycles_per_ray")
    config, unit = CONFIGS[options.config], options.unit
    with Console(stderr=True).status("") as status:
        found = timing(config, unit, options.seed, status.update)
    rates = throughput(found["fmax_mhz"], update, render)
    print_tables(
        _summary(f"{unit} of {options.config}", found, options.seed),
        _path(found["path"]),
        *([_rates(found["fmax_mhz"], rates)] if update or render else []),
    )
    about = {"config": options.config, "unit": unit, "device": DEVICE, "speed_grade": GRADE}
    about |= {"seed": options.seed, "aim_mhz": AIM} | found
    write_json(options.json, about | {"throughput": rates, "board_2006": BOARD_2006})
    return 0


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=box.SIMPLE)
    for k, column in enumerate(columns):
        table.add_column(column, justify="right" if k else "left", overflow="fold")
    return table


def _summary(name: str, found: dict, seed: int) -> Table:
    table = _table(f"{name} alone on an {DEVICE}, speed grade {GRADE}, seed {seed}", "", "")
    table.add_row("clock", f"{found['fmax_mhz']:.1f} MHz")
    for cell, (used, there) in found["resources"].items():
        table.add_row(cell, f"{used:,} of {there:,}, {used / there:.0%}")
    return table


def _path(points: list[dict]) -> Table:
    table = _table("The critical path, from register to register", "signal", "logic", "routing")
    for point in points:
        table.add_row(point["name"], f"{point['logic_ns']:.2f}", f"{point['routing_ns']:.2f}")
    table.add_section()
    sums = (sum(p[key] for p in points) for key in ("logic_ns", "routing_ns"))
    table.add_row("in all, ns", *(f"{x:.2f}" for x in sums))
    return table


def _rates(mhz: float, rates: dict[str, float]) -> Table:
    table = _table(f"At {mhz:.1f} MHz, the clock of an ECP5", "", "here", "the 2006 board")
    for key, rate in rates.items():
        there = BOARD_2006.get(key, ())
        shown = " to ".join(map(_number, there if isinstance(there, tuple) else (there,)))
        table.add_row(TITLES[key], _number(rate), shown)
    return table


def _number(x: float) -> str:
    return f"{x / 1e6:.3g} M" if x >= 1e6 else f"{x:,.0f}"
