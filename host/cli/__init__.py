"""The command `bkd-host`: scenes to a board and pictures back, over a serial port."""

from host.cli import bench, counters, identify, play, ports, render, reset, upload, verify
from host.cli.parser import common
from host.link.errors import LinkError
from sim.command import parser, run

COMMANDS = {
    "render": render,
    "play": play,
    "upload": upload,
    "verify": verify,
    "ports": ports,
    "identify": identify,
    "counters": counters,
    "bench": bench,
    "reset": reset,
}


def main():
    """Run the command."""
    text = "Upload, update and render scenes on a board behind a serial port."
    run(parser("bkd-host", text, COMMANDS, common), LinkError)
