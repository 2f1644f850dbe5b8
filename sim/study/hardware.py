"""Sizes and clocks of the machine by float format, as `bkd-fpga` found them."""

import json
from dataclasses import dataclass
from pathlib import Path

from sim.command import format_of
from sim.errors import InputError

MEASURED = Path(__file__).with_name("hardware.json")
FAMILIES = ("ecp5", "xc4v")
FORMATS = ("5,8", "5,10", "5,12", "6,13", "6,15", "7,16", "7,18", "8,19", "8,21", "8,23")
"""Of 14 to 32 bits: exponents enough for a camera's steps, which those of 4 bits do not reach."""
_PARTS = [(f"{f}_{part}", f, part) for f in FAMILIES for part in ("lut", "multipliers")]
SIZES = tuple(name for name, _, _ in _PARTS)


@dataclass(frozen=True)
class Hardware:
    """What a file of sizes and clocks says.

    The file is JSON: {"command": what found them, "clock_mhz": a number, "formats": {"7,16":
    {"ecp5": {"lut": ..., "multipliers": ..., "clock_mhz": ...}, "xc4v": ...}, ...}}. Formats,
    families and each of their figures may be left out or null.

    Attributes
    ----------
    command : str
    clock_mhz : float
        For formats without a clock of their own.
    formats : dict
    """

    command: str
    clock_mhz: float
    formats: dict[str, dict]

    def figures(self, fmt: str) -> dict:
        """Columns of a format: SIZES, clock_mhz, clock_measured.

        A size is None where it is not known; clock_measured says whether the clock is its own.
        """
        families = self.formats.get(fmt) or {}
        sizes = {name: (families.get(family) or {}).get(part) for name, family, part in _PARTS}
        own = (families.get("ecp5") or {}).get("clock_mhz")
        return {**sizes, "clock_mhz": own or self.clock_mhz, "clock_measured": own is not None}


def read_hardware(file: Path) -> Hardware:
    """Read such a file.

    Raises
    ------
    InputError
        It is not there, or is not what the class says.
    """
    try:
        read = json.loads(file.read_text())
    except (OSError, ValueError) as error:
        raise InputError(f"{file}: cannot be read as JSON: {error}; name another file") from error
    try:
        hardware = Hardware(str(read["command"]), float(read["clock_mhz"]), dict(read["formats"]))
        for fmt in hardware.formats:
            format_of(fmt)
            figures = hardware.figures(fmt)
            for name in (*SIZES, "clock_mhz"):
                if figures[name] is not None and not figures[name] > 0:
                    raise ValueError(f"{name} of {fmt} is above 0, not {figures[name]}")
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            f"{file}: does not say what sizes and clocks are: {type(error).__name__} {error}; "
            f"write it like {MEASURED}"
        ) from error
    return hardware
