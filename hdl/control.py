"""The registers of a machine: jobs go in, status and counters come out."""

from amaranth import *
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl import registers
from hdl.bus.signals import Registers, RegistersInterface
from hdl.config import Config
from hdl.core import frame_job
from hdl.registers import (
    BYTES,
    CONTROL,
    SPAN,
    STATUS,
    UNKNOWN,
    Access,
    Outcome,
    Surroundings,
)


class Phase(enum.Enum, shape=2):
    """Where a run is."""

    IDLE = 0
    START = 1  # the core has not taken the job
    RUN = 2
    HOLD = 3  # cut short: what is under way to memory and back comes to its end


class Control(wiring.Component):
    """Runs a core as the registers of hdl.registers say.

    The core takes the job as it is when CONTROL is written, so its registers can be written
    again at once. A run that the memory fails, or that is stopped, ends when the memory has
    answered all that it was asked; what such a run wrote is not defined, its counters are zero,
    and the next one is as any other.

    Parameters
    ----------
    config : Config
    around : Surroundings
        What its registers say of memory and clock.

    Members
    -------
    bus : In(Registers)
    o : Out(stream of frame_job)
    busy : In(1), of the core
    counters : In(counted), of core and link
    read_failed, write_failed : In(1), the memory answers with an error
    idle : In(1), nothing is under way to the memory
    hold : Out(1), nothing goes from the core to the memory or comes from it
    reset : Out(1), of the core; while `hold`, from a register, since it goes to all of the core
    interrupt : Out(1), until `done` is cleared
    """

    bus: RegistersInterface
    o: stream.Interface
    busy: Signal
    counters: data.View
    read_failed: Signal
    write_failed: Signal
    idle: Signal
    hold: Signal
    reset: Signal
    interrupt: Signal

    def __init__(self, config: Config, around: Surroundings = UNKNOWN):
        self.config = config
        self.around = around
        super().__init__({
            "bus": In(Registers(exact_log2(SPAN // BYTES))),
            "o": Out(stream.Signature(frame_job(config))),
            "counters": In(registers.counted(config)),
            **dict.fromkeys(("busy", "read_failed", "write_failed", "idle"), In(1)),
            **dict.fromkeys(("hold", "reset", "interrupt"), Out(1)),
        })

    def elaborate(self, platform):
        m = Module()

        bus = self.bus
        phase = Signal(Phase)
        reset = Signal(init=1)
        done = Signal()
        outcome = Signal(Outcome)
        control = Signal(CONTROL)
        status = Signal(STATUS)
        written_control = data.View(CONTROL, bus.write_data[: CONTROL.size])
        written_status = data.View(STATUS, bus.write_data[: STATUS.size])
        writes_control = Signal()
        writes_status = Signal()
        m.d.comb += [
            status.busy.eq(phase != Phase.IDLE),
            status.done.eq(done),
            status.outcome.eq(outcome),
            self.o.valid.eq(phase == Phase.START),
            self.hold.eq((phase == Phase.HOLD) | reset),
            self.reset.eq(reset),
            self.interrupt.eq(done & control.interrupt),
        ]

        m.d.sync += reset.eq(phase == Phase.HOLD)

        cycles = Signal(32)
        m.d.sync += cycles.eq(cycles + 1)
        special = {"CONTROL": control.as_value(), "STATUS": status.as_value(), "CYCLES": cycles}
        m.d.sync += [bus.read_data.eq(0), bus.missing.eq(1)]
        with m.Switch(bus.address):
            for register in registers.registers(self.config, self.around):
                with m.Case(register.offset // BYTES):
                    value = C(register.value, 32)
                    if register.access == Access.WRITE:
                        value = _field(self.o.p, register.path)
                        with m.If(bus.write):
                            m.d.sync += value.eq(bus.write_data)
                    elif register.path:
                        value = _field(self.counters, register.path)
                    elif register.name in special:
                        value = special[register.name]
                    m.d.sync += [bus.read_data.eq(value), bus.missing.eq(0)]
                    if register.name == "CONTROL":
                        m.d.comb += writes_control.eq(bus.write)
                    if register.name == "STATUS":
                        m.d.comb += writes_status.eq(bus.write)

        with m.If(writes_control):
            m.d.sync += control.interrupt.eq(written_control.interrupt)
        with m.If(writes_status & written_status.done):
            m.d.sync += done.eq(0)
        with m.Switch(phase):
            with m.Case(Phase.IDLE):
                with m.If(writes_control & written_control.start):
                    m.d.sync += [
                        phase.eq(Phase.START),
                        done.eq(0),
                        outcome.eq(Outcome.COMPLETE),
                    ]
            with m.Case(Phase.START):
                with m.If(self.o.ready):
                    m.d.sync += phase.eq(Phase.RUN)
            with m.Case(Phase.RUN):
                with m.If(~self.busy):
                    m.d.sync += [phase.eq(Phase.IDLE), done.eq(1)]
            with m.Case(Phase.HOLD):
                with m.If(self.idle):
                    m.d.sync += [phase.eq(Phase.IDLE), done.eq(1)]
        runs = (phase == Phase.START) | ((phase == Phase.RUN) & self.busy)
        for ends, how in [
            (writes_control & written_control.stop, Outcome.STOPPED),
            (self.write_failed, Outcome.WRITE_ERROR),
            (self.read_failed, Outcome.READ_ERROR),
        ]:
            with m.If(runs & ends):
                m.d.sync += [phase.eq(Phase.HOLD), outcome.eq(how)]
        return m


def in_reset(m: Module, component, reset: Value):
    """A component whose registers have a reset of their own, and no other."""
    m.domains += ClockDomain("core", local=True)
    m.d.comb += [ClockSignal("core").eq(ClockSignal()), ResetSignal("core").eq(reset)]
    return DomainRenamer("core")(component)


def _field(view: data.View, path: tuple[str, ...]) -> Value:
    """The bits of a field of fields."""
    for name in path:
        view = view[name]
    return Value.cast(view)
