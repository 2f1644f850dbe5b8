"""The command `bkd-fpga`: Verilog, boards, resources and timing."""

from fpga.cli import resources
from fpga.tools import BuildError
from sim.command import parser, run

COMMANDS = {"resources": resources}


def main():
    """Run the command."""
    run(parser("bkd-fpga", "Build a B-KD tree machine for FPGAs.", COMMANDS), BuildError)
