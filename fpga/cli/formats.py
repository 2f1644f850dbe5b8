"""`bkd-fpga formats`."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from fpga.families import FAMILIES
from fpga.resources import resources
from fpga.throughput import BOARD_2006_MHZ
from fpga.timing import timing
from hdl.config import Config
from sim.command import Parser, checked, command_line, format_of
from sim.configuration import config_argument, config_name, read_config
from sim.console import print_tables, table
from sim.files import check_writable, write_json
from sim.study.hardware import FAMILIES as COUNTED
from sim.study.hardware import FORMATS

EXAMPLE = "formats --formats 5,10 7,16 --json hardware.json"


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    config_argument(parser)
    text = "exponent and mantissa bits; ten from 5,8 to 8,23"
    add("--formats", metavar="E,M", nargs="+", default=FORMATS, help=text)
    text = "those to place and route too, for a clock: half an hour each; none"
    add("--clock", metavar="E,M", nargs="*", default=(), help=text)
    text = "write the figures to FILE, for bkd-sim precision --hardware"
    add("--json", metavar="FILE", type=Path, help=text)


def run(options) -> int:
    """Size, and clock, of a machine in several float formats."""
    check_writable(options.json)
    chosen = dict.fromkeys([*options.formats, *options.clock])
    base, name = read_config(options.config), config_name(options.config)
    configs = {text: _config(base, text) for text in chosen}
    found = {}
    with Console(stderr=True).status("") as status:
        for text, config in configs.items():

            def step(what: str, of: str = text):
                status.update(f"{of}: {what}")

            found[text] = {family: _size(config, family, step) for family in COUNTED}
            if text in options.clock:
                found[text]["ecp5"]["clock_mhz"] = timing(config, "core", 1, step)["fmax_mhz"]
    rows = [(text, *_shown(sizes)) for text, sizes in found.items()]
    devices = (FAMILIES[family].device for family in COUNTED)
    header = ("format", *(f"{d}: {what}" for d in devices for what in ("LUT", "mult.")), "MHz")
    print_tables(table(f"The {name} machine by float format", rows, header=header))
    clocks = [
        sizes["ecp5"]["clock_mhz"] for sizes in found.values() if "clock_mhz" in sizes["ecp5"]
    ]
    figures = {
        "command": command_line(),
        "clock_mhz": min(clocks, default=BOARD_2006_MHZ),
        "formats": found,
    }
    write_json(options.json, figures)
    return 0


def _config(base: Config, fmt: str) -> Config:
    return checked(lambda **new: replace(base, **new), fmt=format_of(fmt))


def _size(config: Config, family: str, step: Callable[[str], None]) -> dict:
    core = resources(config, family, step)["core"]
    return {"lut": core["LUT"], "multipliers": core["multipliers"]}


def _shown(sizes: dict) -> list[str]:
    counts = [f"{sizes[family][name]:,}" for family in COUNTED for name in ("lut", "multipliers")]
    clock = sizes["ecp5"].get("clock_mhz")
    return [*counts, f"{clock:.1f}" if clock else ""]
