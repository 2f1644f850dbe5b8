"""A serial line of 8 data bits, no parity and 1 stop bit."""

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

PHASE_BITS = 20
"""Of the fraction of a bit that a cycle is: a rate is off by at most a millionth of the clock."""
FEWEST_CYCLES = 8
"""Of a bit, so that its middle is where it is looked for."""


def bits_a_cycle(clock_hz: float, baud: float) -> int:
    """Bits that pass in a cycle, in units of 2**-PHASE_BITS: what a phase grows by.

    Raises
    ------
    ValueError
        The rate is too high for the clock, or too low for the fraction.
    """
    step = round(baud / clock_hz * (1 << PHASE_BITS))
    if not 16 <= step <= (1 << PHASE_BITS) // FEWEST_CYCLES:
        raise ValueError(
            f"{baud:g} baud from a clock of {clock_hz:g} Hz: a bit takes {FEWEST_CYCLES} to "
            f"{1 << (PHASE_BITS - 4)} cycles"
        )
    return step


class Transmitter(wiring.Component):
    """Sends bytes, the lowest bit first: one in 10 bits, without a gap while bytes come.

    An edge is late by less than a cycle, however many bits were sent before it.

    Parameters
    ----------
    clock_hz : float
    baud : float
        Bits a second; a bit takes 8 cycles at least.

    Members
    -------
    i : In(stream of bytes)
    busy : Out(1), a byte is on its way
    tx : Out(1), the line; high while nothing is sent

    Raises
    ------
    ValueError
        The rate does not go with the clock.
    """

    i: stream.Interface
    busy: Signal
    tx: Signal

    def __init__(self, *, clock_hz: float, baud: float):
        self.step = bits_a_cycle(clock_hz, baud)
        super().__init__({
            "i": In(stream.Signature(8)),
            "busy": Out(1),
            "tx": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        bits = Signal(10, reset_less=True)  # start, data, stop
        left, line = Signal(range(11)), Signal(init=1)
        phase, ends = Signal(PHASE_BITS), Signal()  # of a bit; its last cycle
        passed = Signal(PHASE_BITS + 1)
        m.d.comb += [
            passed.eq(phase + self.step),
            ends.eq(passed[-1]),
            self.busy.eq(left != 0),
            self.tx.eq(line),
            self.i.ready.eq(~self.busy | (ends & (left == 1))),
        ]
        m.d.sync += [
            phase.eq(Mux(self.busy, passed, 0)),
            line.eq(Mux(self.busy, bits[0], 1)),
        ]
        with m.If(self.busy & ends):
            m.d.sync += [bits.eq(bits >> 1), left.eq(left - 1)]
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += [bits.eq(Cat(C(0, 1), self.i.payload, C(1, 1))), left.eq(10)]
        return m


class Receiver(wiring.Component):
    """Gives the bytes of a line, a cycle after the middle of their stop bit.

    A bit is what two of three samples say, an eighth of a bit before its middle, there and an
    eighth after. Each byte is timed from the edge that begins it: a sender may be 2 % fast or
    slow, and leaves no gap. A start bit that is not low is none. A byte whose stop bit is low is
    dropped, and the next one begins after the line has been high: a break counts as one such byte.

    Parameters
    ----------
    clock_hz : float
    baud : float
        Bits a second; a bit takes 8 cycles at least.

    Members
    -------
    rx : In(1), the line, of no clock of ours
    o : Out(stream of bytes), taken at once
    framing_error : Out(1), for a cycle at each byte that is dropped

    Raises
    ------
    ValueError
        The rate does not go with the clock.
    """

    rx: Signal
    o: stream.Interface
    framing_error: Signal

    def __init__(self, *, clock_hz: float, baud: float):
        self.step = bits_a_cycle(clock_hz, baud)
        super().__init__({
            "rx": In(1),
            "o": Out(stream.Signature(8, always_ready=True)),
            "framing_error": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        line = Signal(init=1)
        m.submodules.synchroniser = FFSynchronizer(self.rx, line, init=1)
        left = Signal(range(11))  # bits, with start and stop
        low = Signal()  # ever since a framing error
        phase = Signal(PHASE_BITS)  # of a bit
        passed = Signal(PHASE_BITS)  # that of the next cycle
        seen = Signal(2, reset_less=True)  # the two samples before
        bit = Signal()  # what they and this one say
        samples = Signal()  # an eighth of a bit begins
        decides = Signal()  # it is the one after that in the middle
        m.d.comb += [
            passed.eq(phase + self.step),
            samples.eq(passed[-3] != phase[-3]),  # since a cycle is an eighth at most
            decides.eq(samples & (passed[-3:] == 5)),
            bit.eq((line & seen.any()) | seen.all()),
        ]
        m.d.sync += [
            phase.eq(passed),
            low.eq(low & ~line),
            self.o.valid.eq(0),
            self.framing_error.eq(0),
        ]
        with m.If(samples):
            m.d.sync += seen.eq(Cat(line, seen))
        with m.If(left == 0):
            with m.If(~line & ~low):
                # The edge was half a cycle ago and a sample will be as late, each by a half more
                # or less: a phase of a whole step, which is what the cycle after this one has.
                m.d.sync += [left.eq(10), phase.eq(self.step)]
        with m.Elif(decides):
            m.d.sync += left.eq(left - 1)
            with m.If(left == 10):
                with m.If(bit):
                    m.d.sync += left.eq(0)
            with m.Elif(left != 1):
                m.d.sync += self.o.payload.eq(Cat(self.o.payload[1:], bit))
            with m.Else():
                m.d.sync += [self.o.valid.eq(bit), self.framing_error.eq(~bit), low.eq(~bit)]
        return m
