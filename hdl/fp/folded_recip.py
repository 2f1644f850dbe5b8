"""The reciprocal of a float, on a third of the gates."""

from amaranth import *
from amaranth.lib.wiring import In

from hdl.fp.format import FloatFormat, Rounding
from hdl.fp.recip import STEPS, Recip

TURNS = 3


class FoldedRecip(Recip):
    """Recip, bit for bit, but one reciprocal in three cycles: each stage finds bits in all three.

    Takes `latency` cycles. Nothing waits in it, and of its streams only the payloads count.

    Parameters
    ----------
    fmt : FloatFormat

    Members
    -------
    takes : In(1), in every third cycle, always: i is taken
    i : In(stream of fmt)
    o : Out(stream of fmt), in the order of the inputs, each for three cycles
    """

    takes: Signal

    def __init__(self, fmt: FloatFormat):
        self._init(fmt, {"round": Rounding.NEAREST}, fmt.layout, takes=In(1))

    @staticmethod
    def stages(fmt: FloatFormat) -> int:
        """Stages of three cycles each."""
        return -(-(fmt.man_bits + 1) // (STEPS * TURNS))

    @staticmethod
    def latency_of(fmt: FloatFormat) -> int:
        """The latency of a FoldedRecip: one cycle to take its input, and one to round."""
        return TURNS * FoldedRecip.stages(fmt) + 2

    def elaborate(self, platform):
        m = Module()

        now = self._begin()
        for number in range(self.stages(self.fmt)):
            now = self._stage(m, self.takes, now, number)
            first, found = now["remainder"], now["quotient"]
            for bit in range(STEPS):
                self._bit(m, now, f"{number}_{bit}")
            new = now["quotient"][:STEPS]
            own = Signal(STEPS * (TURNS - 1), name=f"s{number}_own", reset_less=True)
            m.d.sync += own.eq(Cat(new, own))  # of this stage; its last bits go on at once
            with m.If(~self.takes):
                m.d.sync += first.eq(now["remainder"])
            now["quotient"] = Cat(new, own, found)
        more = STEPS * TURNS * self.stages(self.fmt) - (self.fmt.man_bits + 1)
        now["quotient"] = now["quotient"][more:]
        now = self._stage(m, self.takes, now, self.stages(self.fmt))
        m.d.sync += self.o.p.eq(self._rounded(m, now))
        return m
