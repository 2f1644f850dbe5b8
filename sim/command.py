"""What all commands have in common: options whose errors are one line, and exit codes."""

import argparse
import os
import re
import shlex
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from hdl.fp.format import FloatFormat
from sim.errors import InputError


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message):
        raise InputError(f"{message}; see {self.prog} --help")


def parser(
    prog: str,
    description: str,
    commands: dict[str, ModuleType],
    common: Callable[[Parser], None] = lambda _: None,
) -> Parser:
    """A parser of commands by name: modules with EXAMPLE, `arguments` and `run`.

    The options that `common` adds come before the command or after it; those that are not given
    are no attributes of what is parsed.
    """
    shared = Parser(add_help=False, argument_default=argparse.SUPPRESS)
    common(shared)
    top = Parser(prog=prog, description=description, parents=[shared])
    found = top.add_subparsers(metavar="COMMAND", required=True, parser_class=Parser)
    for name, command in commands.items():
        text = (command.run.__doc__ or "").split("\n")[0]
        example = f"Example: {prog} {command.EXAMPLE}"
        top.epilog = top.epilog or example
        sub = found.add_parser(name, help=text, description=text, epilog=example, parents=[shared])
        command.arguments(sub)
        sub.set_defaults(run=command.run)
    return top


def command_line() -> str:
    """What this process was called by, as one would type it again."""
    program = Path(sys.argv[0])
    module = ["python", "-m", program.parent.name]
    return shlex.join([*(module if program.stem == "__main__" else [program.name]), *sys.argv[1:]])


def size_of(text: str, example: str) -> tuple[int, int]:
    """Width and height of an option --size WxH."""
    match = re.fullmatch(r"(\d+)x(\d+)", text)
    if not match or not int(match[1]) * int(match[2]):
        raise InputError(f"--size {text}: give pixels, at least 1 each way, as in {example}")
    return int(match[1]), int(match[2])


def format_of(text: str, option: str = "--format") -> FloatFormat:
    """The format of an option E,M."""
    bits = format_bits(text)
    if not bits:
        raise InputError(f"{option} {text}: give exponent and mantissa bits, as in 7,16")
    return checked(FloatFormat, exp_bits=bits[0], man_bits=bits[1])


def format_bits(text: str) -> tuple[int, int] | None:
    """Exponent and mantissa bits of E,M; None if it is not that."""
    match = re.fullmatch(r"(\d+),(\d+)", text)
    return (int(match[1]), int(match[2])) if match else None


def checked(make, *values, **options):
    """What `make` makes of options; what it refuses is bad input."""
    try:
        return make(*values, **options)
    except ValueError as error:
        raise InputError(str(error)) from error


def run(
    parser: Parser,
    *failures: type[Exception],
    explain: Callable[[argparse.Namespace, Exception], str] = lambda *_: "",
):
    """Run the command that the options name, and exit with what it returns.

    Bad input and `failures`, which a user can mend too, are one line and exit code 2; `explain`
    may add to that.
    """
    code, options = 0, argparse.Namespace()
    try:
        options = parser.parse_args()
        code = options.run(options)
        sys.stdout.flush()
    except (InputError, *failures) as error:
        print(f"{parser.prog}: {error}{explain(options, error)}", file=sys.stderr)
        code = 2
    except KeyboardInterrupt:
        code = 130
    except BrokenPipeError:
        close_stdout()
    except OSError as error:  # a disk that is full, a folder that went
        print(f"{parser.prog}: {error}", file=sys.stderr)
        code = 2
    sys.exit(code)


def close_stdout():
    """The reader of a pipe has seen enough: what is printed from now on is nobody's business."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
