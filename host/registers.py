"""The registers of a board, by their names."""

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from itertools import groupby

from amaranth.lib import data

from hdl.config import FULL, Config
from hdl.core import frame_job
from hdl.fp.format import FloatFormat
from hdl.identification import VERSION, config_of
from hdl.link.protocol import MAGIC
from hdl.registers import (
    BYTES,
    CONTROL_AT,
    STATUS,
    Access,
    Outcome,
    Register,
    registers,
)
from host.link.channel import Channel
from host.link.errors import LinkError

LEAST = replace(FULL, update=False)
"""A machine that says what it has not."""

ENDINGS = {
    Outcome.COMPLETE: "complete",
    Outcome.STOPPED: "stopped",
    Outcome.READ_ERROR: "the memory answered a read with an error",
    Outcome.WRITE_ERROR: "the memory answered a write with an error",
}


@dataclass(frozen=True)
class Status:
    """How a run goes, or how the last one went.

    Attributes
    ----------
    busy, done : bool
    outcome : Outcome
    cycles : int
        Of the board's clock, modulo 2**32.
    """

    busy: bool
    done: bool
    outcome: Outcome
    cycles: int

    def as_dict(self) -> dict:
        """For a file."""
        return {"busy": self.busy, "done": self.done, "outcome": ENDINGS[self.outcome]}


class RegisterMap:
    """Reads and writes the registers of a board.

    Parameters
    ----------
    channel : Channel
    config : Config
    """

    def __init__(self, channel: Channel, config: Config):
        self._channel, self._config = channel, config
        self._by_name = {register.name: register for register in registers(config)}

    def values(self, *names: str) -> dict[str, int]:
        """Registers by name, read at once."""
        return peek(self._channel, [self._by_name[name] for name in names])

    def status(self) -> Status:
        """STATUS and CYCLES."""
        values = self.values("STATUS", "CYCLES")
        bits = data.Const(STATUS, values["STATUS"])
        busy, done = bool(bits["busy"]), bool(bits["done"])
        return Status(busy, done, Outcome(bits["outcome"]), values["CYCLES"])

    def control(self, bits: int):
        """Write CONTROL."""
        self._channel.poke((self._index("CONTROL"), [bits]))

    def start(self, job: dict, bits: int):
        """Write the registers of a job, given by the fields of its layout, and then CONTROL."""
        numbers = frame_job(self._config).const(job)
        values = {
            r.offset // BYTES: _number(numbers, r.path)
            for r in self._by_name.values()
            if r.access == Access.WRITE
        }
        self._channel.poke(*_runs(values), (self._index("CONTROL"), [bits]))

    def counters(self) -> dict:
        """All counters, in dictionaries where layouts hold layouts."""
        block = [r for r in self._by_name.values() if r.access == Access.READ and r.path]
        found: dict = {}
        for name, value in peek(self._channel, block).items():
            inner, path = found, self._by_name[name].path
            for part in path[:-1]:
                inner = inner.setdefault(part, {})
            inner[path[-1]] = value
        return found

    def _index(self, name: str) -> int:
        return self._by_name[name].offset // BYTES


def identification(channel: Channel) -> dict[str, int]:
    """The registers that say what a board is: they lie at the same place on every board.

    Raises
    ------
    LinkError
        It has no such registers, or those of another version.
    """
    block = [r for of in (FULL, LEAST) for r in registers(of) if r.offset < CONTROL_AT]
    block = sorted({r.name: r for r in block}.values(), key=lambda r: r.offset)
    found = peek(channel, [r for r in block if r.name in ("MAGIC", "VERSION")])
    if found["MAGIC"] != MAGIC:
        raise LinkError(f"{channel.name}: the board has no registers of a B-KD tree machine")
    if found["VERSION"] != VERSION:
        raise LinkError(
            f"{channel.name}: the board has version {found['VERSION']} of the registers, and this "
            f"host version {VERSION}; use a host and a board of one release"
        )
    return peek(channel, block)


def config_in(values: dict[str, int], name: str) -> Config:
    """The configuration that the identification of a board says."""
    try:
        return config_of(values)
    except ValueError as error:
        raise LinkError(f"{name}: the board is of no kind that this host knows: {error}") from error


def check_format(config: Config, wanted: FloatFormat | None, name: str):
    """Refuse a board whose floats are not those that are wanted."""
    if wanted and config.fmt != wanted:
        raise LinkError(
            f"{name}: the board's floats are {config.fmt}, not {wanted}; leave out --format, or "
            f"build a board with it"
        )


def check_config(config: Config, wanted: Config, name: str):
    """Refuse a board that is of another configuration than that which is wanted.

    Parameters of units that it has not do not count.
    """
    wanted = config_of({register.name: register.value for register in registers(wanted)})
    for field in fields(Config):
        there, asked = getattr(config, field.name), getattr(wanted, field.name)
        if there != asked:
            raise LinkError(
                f"{name}: the board's {field.name} is {there}, not {asked}; leave out --config, or "
                f"build a board with it"
            )


def peek(channel: Channel, block: list[Register]) -> dict[str, int]:
    """Registers by name; those that are near each other are read at once."""
    first = block[0].offset // BYTES
    values = channel.peek(first, block[-1].offset // BYTES - first + 1)
    return {register.name: values[register.offset // BYTES - first] for register in block}


def _runs(values: dict[int, int]) -> Iterator[tuple[int, list[int]]]:
    """Values by ascending index in runs of neighbours, each with its first index."""
    for _, run in groupby(enumerate(values), lambda pair: pair[1] - pair[0]):
        indices = [index for _, index in run]
        yield indices[0], [values[index] for index in indices]


def _number(fields: data.Const, path: tuple[str, ...]) -> int:
    value = fields
    for name in path:
        value = value[name]
    return value if isinstance(value, int) else value.as_bits()
