"""The command `bkd-sim`: build, simulate, check, report."""

import os
import sys

from sim.cli import disasm, info, render, replay, update
from sim.cli.parser import Parser
from sim.cosim.verilate import SimulationError
from sim.errors import InputError

COMMANDS = {
    "render": render,
    "update": update,
    "info": info,
    "disasm": disasm,
    "replay": replay,
}


def parser() -> Parser:
    """All commands and their options."""
    top = Parser(prog="bkd-sim", description="Simulate, check and measure a B-KD tree machine.")
    top.epilog = "Example: bkd-sim render walker --frame 6"
    commands = top.add_subparsers(metavar="COMMAND", required=True, parser_class=Parser)
    for name, command in COMMANDS.items():
        text = (command.run.__doc__ or "").split("\n")[0]
        example = f"Example: bkd-sim {command.EXAMPLE}"
        sub = commands.add_parser(name, help=text, description=text, epilog=example)
        command.arguments(sub)
        sub.set_defaults(run=command.run)
    return top


def main():
    """Run the command; errors that a user can mend are one line, and exit code 2."""
    try:
        options = parser().parse_args()
        sys.exit(options.run(options))
    except (InputError, SimulationError) as error:
        print(f"bkd-sim: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
