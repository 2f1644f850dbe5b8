"""`bkd-host ports`."""

from host.link.port import ports
from sim.command import Parser
from sim.console import print_tables, table
from sim.files import check_writable, write_json
from sim.options import json_argument

EXAMPLE = "ports"


def arguments(parser: Parser):
    """Options of the command."""
    json_argument(parser)


def run(options) -> int:
    """List the serial ports of this computer."""
    check_writable(options.json)
    found = ports()
    if found:
        rows = [(port.url, port.description, port.hardware) for port in found]
        print_tables(table("Serial ports", rows, header=("--port", "it says", "hardware")))
    else:
        print("There are no serial ports.")
    figures = [{"port": p.url, "description": p.description, "hardware": p.hardware} for p in found]
    write_json(options.json, {"ports": figures})
    return 0
