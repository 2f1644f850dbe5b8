"""The register map: what a processor on the bus, or the other end of a serial link, can see.

======  =======================================================================================
offset  registers
======  =======================================================================================
0x000   identification: what was built; constant
0x040   CONTROL, STATUS and CYCLES
0x100   the job: a register for each number in hdl.core.frame_job, in its order
0x200   counters: a register for each in hdl.core.counters, in its order
0x300   counters of the serial link: a register for each in LINK; zero where there is none
======  =======================================================================================

Offsets are in bytes and the same in every configuration: what a machine has no unit for leaves its
places empty. A map in which one moves has another VERSION. Floats are bit patterns in the lowest
bits of a register, addresses count memory words.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from amaranth.hdl import Shape
from amaranth.lib import data, enum

from hdl import core
from hdl.config import Config
from hdl.core import frame_job
from hdl.fp.format import FloatFormat
from hdl.identification import UNKNOWN, Surroundings, identification

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


LINKED = data.StructLayout({"link": LINK})


def counted(config: Config) -> data.StructLayout:
    """All that a machine counts: core and link."""
    return data.StructLayout({**core.counters(config).members, **LINKED.members})


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
        Of the field of frame_job, or of `counted`, that it is.
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
    found = [
        *(
            Register(name, IDENTIFICATION_AT + BYTES * place, Access.READ, 8 * BYTES, value, doc)
            for name, (place, value, doc) in identification(config, around).items()
        ),
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
    ]  # fmt: skip
    whole = replace(config, update=True, camera=True, source=True)
    for prefix, at, access, doc, layout in [
        (("JOB",), JOB_AT, Access.WRITE, "field {} of hdl.core.frame_job", frame_job),
        (("COUNT",), COUNTERS_AT, Access.READ, "counter {} of hdl.core", core.counters),
        ((), LINK_AT, Access.READ, "counter {}, since reset", lambda _: LINKED),
    ]:
        there, places = (_leaves(config.fmt, layout(of)) for of in (config, whole))
        found += _block(prefix, at, access, doc, there, places)
    for before, after in zip(found, found[1:], strict=False):
        if before.offset >= after.offset:
            raise ValueError(f"{before.name} runs into {after.name}")
    return found


def _block(
    prefix: tuple[str, ...],
    at: int,
    access: Access,
    doc: str,
    there: Iterable[tuple[tuple[str, ...], int]],
    places: Iterable[tuple[tuple[str, ...], int]],
) -> list[Register]:
    """Registers of the numbers that are there, each in its place among all that may be."""
    offsets = {path: at + BYTES * k for k, (path, _) in enumerate(places)}
    found = []
    for path, width in there:
        name = "_".join((*prefix, *path)).upper()
        if width > 8 * BYTES:
            raise ValueError(f"{name}: a register has {8 * BYTES} bits, not {width}")
        text = doc.format(".".join(path))
        found.append(Register(name, offsets[path], access, width, 0, text, path))
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
