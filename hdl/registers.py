"""The register map: what a processor on the bus, or the other end of a serial link, can see.

======  =======================================================================================
offset  registers
======  =======================================================================================
0x000   identification: what was built; constant
0x040   CONTROL, STATUS and CYCLES
0x100   the job: a register for each number in hdl.core.frame_job, in its order
0x200   counters: a register for each in hdl.core.COUNTERS, in its order
0x300   counters of the serial link: a register for each in LINK; zero where there is none
======  =======================================================================================

Offsets are in bytes and the same in every configuration; a map in which one moves has another
VERSION. Floats are bit patterns in the lowest bits of a register, addresses count memory words.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields

from amaranth.hdl import Shape
from amaranth.lib import data, enum

from hdl.config import Config
from hdl.core import COUNTERS, frame_job
from hdl.fp.format import FloatFormat
from hdl.records import word_bits

MAGIC = int.from_bytes(b"BKDT", "big")
VERSION = 3
BYTES = 4
"""Bytes of a register."""

SPAN = 0x1000
"""Bytes that the map takes in an address space."""

IDENTIFICATION_AT, CONTROL_AT, JOB_AT, COUNTERS_AT, LINK_AT = 0x000, 0x040, 0x100, 0x200, 0x300


class Access(enum.Enum, shape=2):
    """What a register is for."""

    READ = 0  # writes do nothing
    WRITE = 1  # reads give what was written last
    SPECIAL = 2  # as its fields say


class Outcome(enum.Enum, shape=2):
    """How the last run went."""

    COMPLETE = 0
    STOPPED = 1
    READ_ERROR = 2  # the memory answered a read with an error
    WRITE_ERROR = 3


CONTROL = data.StructLayout({"start": 1, "stop": 1, "interrupt": 1})
"""start and stop do so where 1 is written, and read as 0. A start while busy does nothing, nor
does a stop while not. With `interrupt` the interrupt line is that of `done`."""

STATUS = data.StructLayout({"busy": 1, "done": 1, "outcome": Outcome})
"""`done` is set when a run ends, and cleared by a 1 that is written to it, or by a start.
`outcome` holds until the next start."""


LINK = data.StructLayout(dict.fromkeys(("framing_errors", "damaged", "lost", "executed"), 32))
"""Since reset. Bytes without a stop bit, frames that are damaged, frames that found no room, and
commands that were executed."""

COUNTED = data.StructLayout({**{name: field.shape for name, field in COUNTERS}, "link": LINK})
"""All that a machine counts."""


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


@dataclass(frozen=True)
class Register:
    """A register of 32 bits.

    Attributes
    ----------
    name : str
    offset : int
        Bytes from the first register.
    access : Access
    width : int
        Bits that mean something: the lowest ones. The others read as 0.
    value : int
        Of a constant, or after reset.
    doc : str
    path : tuple of str
        Of the field of frame_job, or of COUNTED, that it is.
    fields : Layout, optional
        Of its bits.
    """

    name: str
    offset: int
    access: Access
    width: int
    value: int
    doc: str
    path: tuple[str, ...] = ()
    fields: data.StructLayout | None = None


def registers(config: Config, around: Surroundings = UNKNOWN) -> list[Register]:
    """All registers, by offset.

    Raises
    ------
    ValueError
        A number of the job is wider than a register.
    """
    job = _leaves(config.fmt, frame_job(config))
    counters = _leaves(config.fmt, COUNTERS)
    link = _leaves(config.fmt, LINK, ("link",))
    found = [
        *_identification(config, around),
        Register(
            "CONTROL", CONTROL_AT, Access.SPECIAL, CONTROL.size, 0, "starts and stops runs",
            fields=CONTROL,
        ),
        Register(
            "STATUS", CONTROL_AT + BYTES, Access.SPECIAL, STATUS.size, 0, "of the last run",
            fields=STATUS,
        ),
        Register(
            "CYCLES", CONTROL_AT + 2 * BYTES, Access.READ, 32, 0, "of the clock; runs over",
        ),
        *_block(("JOB",), JOB_AT, Access.WRITE, job, "field {} of hdl.core.frame_job"),
        *_block(("COUNT",), COUNTERS_AT, Access.READ, counters, "counter {} of hdl.core"),
        *_block((), LINK_AT, Access.READ, link, "counter {}, since reset"),
    ]  # fmt: skip
    for before, after in zip(found, found[1:], strict=False):
        if before.offset >= after.offset:
            raise ValueError(f"{before.name} runs into {after.name}")
    return found


def _identification(config: Config, around: Surroundings) -> list[Register]:
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
        "LATENCY": (config.latency, "cycles of a memory read that the update processor hides"),
        "MEMORY_WORDS": (around.words, "that there are, or 0 if unknown"),
        "CLOCK_HZ": (around.clock_hz, "of the machine, or 0 if unknown"),
    }
    return [
        Register(name, IDENTIFICATION_AT + BYTES * k, Access.READ, 8 * BYTES, value, doc)
        for k, (name, (value, doc)) in enumerate(constants.items())
    ]


def config_of(values: Mapping[str, int]) -> Config:
    """The configuration of a machine whose identification registers hold these values."""
    others = (field.name for field in fields(Config) if field.name != "fmt")
    return Config(
        FloatFormat(values["EXPONENT_BITS"], values["MANTISSA_BITS"]),
        **{name: values[name.upper()] for name in others},
    )


def _block(
    prefix: tuple[str, ...], at: int, access: Access, leaves: Iterator, doc: str
) -> list[Register]:
    found = []
    for k, (path, width) in enumerate(leaves):
        name = "_".join((*prefix, *path)).upper()
        if width > 8 * BYTES:
            raise ValueError(f"{name}: a register has {8 * BYTES} bits, not {width}")
        offset, text = at + BYTES * k, doc.format(".".join(path))
        found.append(Register(name, offset, access, width, 0, text, path))
    return found


def _leaves(
    fmt: FloatFormat, layout: data.StructLayout, above: tuple[str, ...] = ()
) -> Iterator[tuple[tuple[str, ...], int]]:
    """Path and width of each number in a layout; floats are whole."""
    for name, field in layout:
        path = (*above, str(name))
        if isinstance(field.shape, data.StructLayout) and field.shape != fmt.layout:
            yield from _leaves(fmt, field.shape, path)
        else:
            yield path, Shape.cast(field.shape).width
