"""The command `bkd-sim`: build, simulate, check, report."""

from sim.cli import analyse, board, disasm, fit, info, precision, render, replay, stability, update
from sim.command import parser, run
from sim.configuration import explain
from sim.cosim.verilate import SimulationError

COMMANDS = {
    "render": render,
    "update": update,
    "info": info,
    "analyse": analyse,
    "fit": fit,
    "disasm": disasm,
    "replay": replay,
    "precision": precision,
    "stability": stability,
    "board": board,
}


def main():
    """Run the command."""
    text = "Simulate, check and measure a B-KD tree machine."
    run(parser("bkd-sim", text, COMMANDS), SimulationError, explain=explain)
