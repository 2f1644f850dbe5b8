"""The machine as a host sees it: a core, its registers and its memory, behind a line of bytes."""

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.control import Control, in_reset
from hdl.core import Core
from hdl.identification import Surroundings
from hdl.link.link import Link
from hdl.memory.arbiter import Arbiter
from hdl.memory.gate import Gate
from hdl.memory.port import Port, PortInterface


class LinkedCore(wiring.Component):
    """A core that a host commands by the frames of hdl.link.protocol, on one memory with it.

    ::

        i ─► link ─┬─► registers ─► control ─► core
        o ◄──┘     │                            │
                   └──────► arbiter ◄── gate ◄──┘
                               └─► port

    Parameters
    ----------
    config : Config
        With caches: the memory has one port.
    around : Surroundings
        With the number of memory words.
    outstanding : int
        Reads that the memory has room for.

    Members
    -------
    i : In(stream of bytes), taken at once
    o : Out(stream of bytes)
    port : Out(Port)
    unsettled : In(1), as in hdl.core
    read_failed, write_failed : In(1), the memory answers with an error
    framing_error : In(1), a byte was none
    busy : Out(1), a run is under way
    executed : Out(32), commands since reset

    Raises
    ------
    ValueError
        The configuration has no caches, and so three memory ports; or the words are none.
    """

    i: stream.Interface
    o: stream.Interface
    port: PortInterface
    unsettled: Signal
    read_failed: Signal
    write_failed: Signal
    framing_error: Signal
    busy: Signal
    executed: Signal

    def __init__(self, config: Config, around: Surroundings, *, outstanding: int = 128):
        if not config.cache_words:
            raise ValueError("memory with one port wants caches: cache_words is 0")
        if not 1 <= around.words <= 1 << config.address_bits:
            raise ValueError(
                f"1 to {1 << config.address_bits} words have an address, and these are "
                f"{around.words}"
            )
        self.config = config
        self.around = around
        self.outstanding = outstanding
        failures = "read_failed", "write_failed", "framing_error"
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            "o": Out(stream.Signature(8)),
            "port": Out(Port(config)),
            **dict.fromkeys(("unsettled", *failures), In(1)),
            "busy": Out(1),
            "executed": Out(32),
        })

    def elaborate(self, platform):
        m = Module()
        config = self.config

        core = Core(config)
        m.submodules.control = control = Control(config, self.around)
        m.submodules.core = in_reset(m, core, control.reset)
        m.submodules.gate = gate = Gate(config, self.outstanding)
        m.submodules.link = link = Link(config, self.around.words)
        m.submodules.arbiter = arbiter = Arbiter(config, clients=2, outstanding=self.outstanding)
        wiring.connect(m, wiring.flipped(self.i), link.i)
        wiring.connect(m, link.o, wiring.flipped(self.o))
        wiring.connect(m, link.registers, control.bus)
        wiring.connect(m, control.o, core.i)
        wiring.connect(m, core.port, gate.client)
        wiring.connect(m, gate.port, arbiter.clients[0])
        wiring.connect(m, link.port, arbiter.clients[1])
        wiring.connect(m, arbiter.port, wiring.flipped(self.port))

        unsettled = self.unsettled | self.port.request.valid  # or still in the arbiter
        counts = control.counters.link
        for name, event in [
            ("framing_errors", self.framing_error),
            ("damaged", link.damaged),
            ("lost", link.lost),
            ("executed", link.executed),
        ]:
            count = Signal(32, name=name)
            m.d.sync += count.eq(count + event)
            m.d.comb += counts[name].eq(count)
        m.d.comb += [
            control.busy.eq(core.busy),
            *(control.counters[name].eq(core.counters[name]) for name, _ in core.counters.shape()),
            control.read_failed.eq(self.read_failed),
            control.write_failed.eq(self.write_failed),
            control.idle.eq(gate.idle & ~unsettled),
            gate.shut.eq(control.hold),
            core.unsettled.eq(unsettled),
            link.unsettled.eq(unsettled),
            link.failed.eq(self.read_failed | self.write_failed),
            self.busy.eq(core.busy),
            self.executed.eq(counts.executed),
        ]
        return m
