"""Files in which a user says where the pins of a board are."""

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path

from sim.errors import InputError

FILL_IN = "FILL_IN"
"""What the name of a pin begins with that a user has not said."""

OPTIONS = {"package": r"ff\d{3,4}", "speed": r"1[012]", "iostandard": r"(LVCMOS|LVTTL)\w*"}
PIN = r"[A-Z]{1,2}[0-9]{1,2}"


def read_pins(file: Path, names: Sequence[str]) -> dict[str, str]:
    """Pins by name, of a TOML file: `clk = "AB12"` for each, and the OPTIONS.

    Raises
    ------
    InputError
        The file or an entry is at fault.
    """
    try:
        found = tomllib.loads(file.read_text())
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}; name a file of pins") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f'{file}: {error}; a line is like clk = "AB12"') from error
    for name, value in found.items():
        pattern = PIN if name in names else OPTIONS.get(name)
        if pattern is None:
            known = ", ".join([*names, *OPTIONS])
            raise InputError(f"{file}: there is no pin {name}; the names are {known}")
        if not isinstance(value, str) or not re.fullmatch(pattern, value):
            raise InputError(f"{file}: {name} = {value!r} is no pin; write it like {name} = 'AB12'")
    places = [value for name, value in found.items() if name in names]
    for value in places:
        if places.count(value) > 1:
            raise InputError(f"{file}: {value} is the pin of two; each has its own")
    return found


def comment_missing(constraints: str) -> str:
    """Lines of a constraint file that wait for a pin, as comments."""
    return "".join(
        f"# {line}" if FILL_IN in line else line for line in constraints.splitlines(keepends=True)
    )
