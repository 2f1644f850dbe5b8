"""The machine as a part of a chip: a core between AXI4 memory and AXI4-Lite registers."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.bus.axi import AxiMaster
from hdl.bus.axilite import AxiLiteSlave
from hdl.bus.reader import axi
from hdl.bus.signals import Axi4Interface, AxiLite, AxiLiteInterface
from hdl.config import Config
from hdl.control import Control, in_reset
from hdl.core import Core
from hdl.registers import SPAN


class System(wiring.Component):
    """A core that a processor gives jobs, and that shares the processor's memory.

    ::

        s_axi ─► registers ─► control ─► core ─► master ─► m_axi
                                └─► irq

    Parameters
    ----------
    config : Config

    Members
    -------
    s_axi : In(AxiLite), the registers of hdl.registers
    m_axi : Out(Axi4), memory; the address of a word is that in the records, times its bytes
    irq : Out(1), a run has ended; high until that is acknowledged

    Raises
    ------
    ValueError
        The configuration has no caches, and so three memory ports.
    """

    s_axi: AxiLiteInterface
    m_axi: Axi4Interface
    irq: Signal

    def __init__(self, config: Config):
        if not config.cache_words:
            raise ValueError("one bus to the memory needs caches: cache_words is 0")
        self.config = config
        super().__init__({
            "s_axi": In(AxiLite(exact_log2(SPAN))),
            "m_axi": Out(axi(config)),
            "irq": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        core = Core(self.config)
        m.submodules.control = control = Control(self.config)
        m.submodules.core = in_reset(m, core, control.reset)
        m.submodules.master = master = AxiMaster(self.config)
        m.submodules.registers = registers = AxiLiteSlave(exact_log2(SPAN))
        wiring.connect(m, wiring.flipped(self.s_axi), registers.axi)
        wiring.connect(m, registers.registers, control.bus)
        wiring.connect(m, control.o, core.i)
        wiring.connect(m, core.port, master.port)
        wiring.connect(m, master.axi, wiring.flipped(self.m_axi))
        m.d.comb += [
            control.busy.eq(core.busy),
            *(control.counters[name].eq(core.counters[name]) for name, _ in core.counters.shape()),
            control.read_failed.eq(master.read_failed),
            control.write_failed.eq(master.write_failed),
            control.idle.eq(master.idle),
            master.flush.eq(control.hold),
            core.unsettled.eq(~master.settled),
            self.irq.eq(control.interrupt),
        ]
        return m
