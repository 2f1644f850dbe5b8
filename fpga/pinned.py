"""A unit alone on a device: between registers, on three pins."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class Pinned(wiring.Component):
    """Feeds a unit's inputs from a shift register and folds its outputs into another.

    All that goes into the unit and comes out of it is a register, so that place and route sees
    the unit's own paths and leaves nothing out. There is no reset: the bitstream says how registers
    begin, as it does on a board.

    Parameters
    ----------
    unit : wiring.Component

    Members
    -------
    clk : In(1)
    d : In(1), into the shift register of inputs
    q : Out(1), what the outputs fold to
    """

    clk: In(1)
    d: In(1)
    q: Out(1)

    def __init__(self, unit):
        self.unit = unit
        super().__init__()

    def elaborate(self, platform):
        m = Module()
        m.domains.sync = ClockDomain(reset_less=True)
        m.d.comb += ClockSignal().eq(self.clk)
        m.submodules.unit = self.unit

        members = [
            (Value.cast(value), member.flow)
            for _, member, value in self.unit.signature.flatten(self.unit)
        ]
        into = Cat(value for value, flow in members if flow == In)
        out = Cat(value for value, flow in members if flow == Out)
        given, taken, folded = Signal(len(into)), Signal(len(out)), Signal(len(out))
        m.d.sync += [
            given.eq(Cat(self.d, given)),
            taken.eq(out),
            folded.eq(Cat(C(0, 1), folded) ^ taken),
            self.q.eq(folded[-1]),
        ]
        m.d.comb += into.eq(given)
        return m
