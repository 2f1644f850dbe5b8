"""What all commands have in common: options whose errors are one line, and exit codes."""

import argparse
import os
import sys

from sim.errors import InputError


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line."""

    def error(self, message):
        raise InputError(f"{message}; see {self.prog} --help")


def run(parser: Parser, *failures: type[Exception]):
    """Run the command that the options name, and exit with what it returns.

    Bad input and `failures`, which a user can mend too, are one line and exit code 2.
    """
    try:
        options = parser.parse_args()
        sys.exit(options.run(options))
    except (InputError, *failures) as error:
        print(f"{parser.prog}: {error}", file=sys.stderr)
        sys.exit(2)
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:  # the reader of a pipe has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
