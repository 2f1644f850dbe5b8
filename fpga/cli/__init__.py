"""The command `bkd-fpga`: Verilog, boards, resources and timing."""

from fpga.cli import build, formats, load, resources, timing, verilog
from fpga.tools import BuildError
from sim.command import parser, run

COMMANDS = {
    "build": build,
    "formats": formats,
    "load": load,
    "resources": resources,
    "timing": timing,
    "verilog": verilog,
}


def main():
    """Run the command."""
    run(parser("bkd-fpga", "Build a B-KD tree machine for FPGAs.", COMMANDS), BuildError)
