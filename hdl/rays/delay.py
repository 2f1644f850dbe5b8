"""Units joined to a pipeline that steps as one: what is there early waits for what is late."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from amaranth import *
from amaranth.lib import data, memory

from hdl.fp.format import FloatFormat

REGISTERS = 3  # a longer delay is a memory


@dataclass(frozen=True, eq=False)
class Timed:
    """A value of a pipeline, and how many cycles after the input it is there.

    One that is steady does not change while anything that depends on it is under way.
    """

    name: str
    value: Value | data.View
    cycle: int
    steady: bool = False


class Pipeline:
    """Values that depend on each other, each in its cycle; nothing waits, so one input a cycle.

    Goes into a module as `EnableInserter(step)(pipeline.m)`. Of a unit's streams only the
    payloads are used.

    Attributes
    ----------
    m : Module
    """

    def __init__(self):
        self.m = Module()
        self._delayed: dict[tuple[Timed, int], Value | data.View] = {}
        self._overflows: list[tuple[FloatFormat, Timed]] = []

    def input(self, name: str, value) -> Timed:
        """A value that is there in cycle 0."""
        return Timed(name, value, 0)

    def steady(self, name: str, value) -> Timed:
        """A value that does not change while anything that depends on it is under way."""
        return Timed(name, value, 0, steady=True)

    def at(self, x: Timed, cycle: int) -> Value | data.View:
        """A value as it is in a cycle not before its own."""
        wait = cycle - x.cycle
        if wait < 0:
            raise ValueError(f"{x.name} is there in cycle {x.cycle}, not in {cycle}")
        if wait == 0 or x.steady:
            return x.value
        if (x, wait) not in self._delayed:
            make = self._register if wait <= REGISTERS else self._memory
            self._delayed[x, wait] = make(x, wait)
        return self._delayed[x, wait]

    def apply(self, name: str, function: Callable, *operands: Timed) -> Timed:
        """What a combinational function makes of values: there with the last of them."""
        cycle = max(x.cycle for x in operands)
        return Timed(name, function(*(self.at(x, cycle) for x in operands)), cycle)

    def stage(self, x: Timed) -> Timed:
        """A value behind a register."""
        return Timed(f"{x.name}_q", self.at(x, x.cycle + 1), x.cycle + 1)

    def unit(self, name: str, unit, *operands: Timed) -> Timed:
        """What a unit makes of its operands, in the order of the fields of its input."""
        self.m.submodules[name] = unit
        cycle = max(x.cycle for x in operands)
        values = [self.at(x, cycle) for x in operands]
        fields = [unit.i.p] if len(values) == 1 else [unit.i.p[f] for f, _ in unit.i.p.shape()]
        self.m.d.comb += [field.eq(value) for field, value in zip(fields, values, strict=True)]
        self.m.d.comb += [unit.i.valid.eq(1), unit.o.ready.eq(1)]
        if hasattr(unit, "overflow"):
            overflow = Timed(f"{name}_overflow", unit.overflow, cycle + unit.latency)
            self._overflows.append((unit.fmt, overflow))
        return Timed(name, unit.o.p, cycle + unit.latency)

    def overflow(self, fmt: FloatFormat, valid: Sequence[Value]) -> Value:
        """A unit of a format has made an infinity of finite numbers.

        `valid` says for each cycle whether it is that of an input that counts.
        """
        return Cat(x.value & valid[x.cycle] for of, x in self._overflows if of == fmt).any()

    def _register(self, x: Timed, wait: int):
        late = Signal(x.value.shape(), name=f"{x.name}_{wait}", reset_less=True)
        self.m.d.sync += late.eq(self.at(x, x.cycle + wait - 1))
        return late

    def _memory(self, x: Timed, wait: int):
        """A ring of one word less: it is read just before it is written, into a register."""
        ring = memory.Memory(shape=x.value.shape(), depth=wait - 1, init=[])
        self.m.submodules[f"{x.name}_{wait}"] = ring
        write, read = ring.write_port(), ring.read_port()
        place = Signal(range(wait - 1), name=f"{x.name}_{wait}_place")
        self.m.d.sync += place.eq(Mux(place == wait - 2, 0, place + 1))
        self.m.d.comb += [
            read.addr.eq(place),
            write.addr.eq(place),
            write.data.eq(x.value),
            write.en.eq(1),
        ]
        return read.data
