"""`bkd-sim disasm`."""

from sim.cli.parser import config_of, machine_arguments
from sim.command import Parser
from sim.compiler.disassemble import disassemble
from sim.errors import InputError
from sim.options import compiler_of, divide_argument, scene_arguments, scene_of

EXAMPLE = "disasm walker | head"


def arguments(parser: Parser):
    """Options of the command."""
    scene_arguments(parser)
    divide_argument(parser)
    machine_arguments(parser)


def run(options) -> int:
    """Print the program of a scene, an instruction a line."""
    config = config_of(options)
    if not config.update:
        raise InputError("the machine has no update processor, and so no program: nothing to show")
    prepared = compiler_of(options)(scene_of(options), config, builder=options.builder)
    for index, line in enumerate(disassemble(prepared.image.instructions)):
        print(f"{index:8}  {line}")
    return 0
