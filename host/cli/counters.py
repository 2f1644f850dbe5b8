"""`bkd-host counters`."""

from collections.abc import Iterator

from host.cli.parser import board_of
from host.registers import ENDINGS
from sim.command import Parser
from sim.console import print_tables, table
from sim.files import check_writable, write_json
from sim.options import json_argument

EXAMPLE = "counters --json counters.json"
TITLES = {
    "update": "The last update",
    "cast": "The last rays",
    "nodes": "The cache of nodes, in the last rays",
    "geometry": "The cache of geometry, in the last rays",
    "link": "The link, since reset",
}


def arguments(parser: Parser):
    """Options of the command."""
    json_argument(parser)


def run(options) -> int:
    """Show what a board has counted in its last runs, and on its link."""
    check_writable(options.json)
    with board_of(options) as board:
        status, counters = board.status(), board.counters()
    tables = [
        table(TITLES.get(name) or name, [(text, f"{n:,}") for text, n in _flat(block)])
        for name, block in counters.items()
    ]
    print_tables(*tables)
    if status.busy:
        print("A run is under way: its counters are not final.")
    elif status.done:
        print(f"The last run: {ENDINGS[status.outcome]}.")
    write_json(options.json, {"status": status.as_dict(), "counters": counters})
    return 0


def _flat(block: dict, above: str = "") -> Iterator[tuple[str, int]]:
    for name, value in block.items():
        text = f"{above}{name.replace('_', ' ')}"
        if isinstance(value, dict):
            yield from _flat(value, f"{text}: ")
        else:
            yield text, value
