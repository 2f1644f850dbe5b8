"""The command `bkd-sim`: build, simulate, check, report."""

from sim.cli import disasm, info, render, replay, update
from sim.command import Parser, run
from sim.cosim.verilate import SimulationError

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
    """Run the command."""
    run(parser(), SimulationError)
