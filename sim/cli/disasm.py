"""`bkd-sim disasm`."""

from sim.cli.parser import config_of, format_argument
from sim.command import Parser
from sim.compiler.disassemble import disassemble
from sim.options import scene_arguments, scene_of
from sim.prepare import prepare

EXAMPLE = "disasm walker | head"


def arguments(parser: Parser):
    """Options of the command."""
    scene_arguments(parser)
    format_argument(parser)


def run(options) -> int:
    """Print the program of a scene, an instruction a line."""
    prepared = prepare(scene_of(options), config_of(options.format), builder=options.builder)
    for index, line in enumerate(disassemble(prepared.image.instructions)):
        print(f"{index:8}  {line}")
    return 0
