"""What a machine says of itself, in registers that are constant."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

from amaranth.lib import data

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from hdl.records import word_bits

MAGIC = int.from_bytes(b"BKDT", "big")
VERSION = 3
"""Of the register map."""

UNITS = data.StructLayout({
    **dict.fromkeys(("no_update", "no_camera", "no_source"), 1),
    "less_pointer_bits": 5,
    "instances": 1,
    "folded": 1,
})
"""By what a machine differs from the full one. Where that is nothing there is no such
register, and a host that asks for it reads 0."""


@dataclass(frozen=True)
class Surroundings:
    """What a machine is told of where it is, to tell whoever asks.

    Attributes
    ----------
    words : int
        Of its memory, from address 0 on. 0 if unknown.
    clock_hz : int
        0 if unknown.
    """

    words: int = 0
    clock_hz: int = 0


UNKNOWN = Surroundings()


def identification(
    config: Config, around: Surroundings = UNKNOWN
) -> dict[str, tuple[int, int, str]]:
    """Place, value and meaning of each register by its name. A place is that of one register."""
    constants = {
        "MAGIC": (MAGIC, "the letters BKDT"),
        "VERSION": (VERSION, "of this map"),
        "EXPONENT_BITS": (config.fmt.exp_bits, "of a float"),
        "MANTISSA_BITS": (config.fmt.man_bits, "of a float, without the hidden one"),
        "WORD_BITS": (word_bits(config.fmt), "of a memory word"),
        "ADDRESS_BITS": (config.address_bits, "of the address of a memory word"),
        "VERTEX_REGISTERS": (config.vertex_registers, "of the update processor"),
        "BOX_REGISTERS": (config.box_registers, "of the update processor"),
        "PACKETS": (config.packets, "of rays in flight"),
        "STACK_DEPTH": (config.stack_depth, "nodes that a packet can have waiting"),
        "CACHE_WORDS": (config.cache_words, "of the caches of nodes and of geometry, each"),
        "LATENCY": (config.latency, "cycles of a memory read that it hides"),
        "MEMORY_WORDS": (around.words, "that there are, or 0 if unknown"),
        "CLOCK_HZ": (around.clock_hz, "of the machine, or 0 if unknown"),
        "UNITS": (_units(config), "by which it is another than the full machine"),
    }
    places = {name: (k, *of) for k, (name, of) in enumerate(constants.items())}
    for name in _missing(places["UNITS"][1]):
        del places[name]
    return places


def _units(config: Config) -> int:
    less = {f"no_{unit}": not getattr(config, unit) for unit in ("update", "camera", "source")}
    return UNITS.const({
        **less,
        "less_pointer_bits": FULL.pointer_bits - config.pointer_bits,
        "instances": config.instances,
        "folded": config.folded,
    }).as_bits()


def _missing(units: int) -> list[str]:
    """Registers that a machine of such UNITS has not."""
    registers = ["VERTEX_REGISTERS", "BOX_REGISTERS"] if UNITS.from_bits(units).no_update else []
    return registers if units else ["UNITS"]


def config_of(values: Mapping[str, int]) -> Config:
    """The configuration of a machine whose identification registers hold these values.

    Parameters of units that it has not are those of the full machine.

    Raises
    ------
    ValueError
        There is no such machine.
    """
    units = values.get("UNITS", 0)
    less = UNITS.from_bits(units)
    there = {name.lower(): value for name, value in values.items() if name not in _missing(units)}
    numbers = {field.name: there[field.name] for field in fields(Config) if field.name in there}
    return Config(
        FloatFormat(values["EXPONENT_BITS"], values["MANTISSA_BITS"]),
        **numbers,
        **{unit: not less[f"no_{unit}"] for unit in ("update", "camera", "source")},
        pointer_bits=FULL.pointer_bits - less["less_pointer_bits"],
        **{name: bool(less[name]) for name in ("instances", "folded")},
    )
