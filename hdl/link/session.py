"""Which command is the next one, which was done before, and which is of nobody here."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

SEQUENCE_BITS = 16


class Session(wiring.Component):
    """Holds the session of a board and the number that it expects.

    What it says of a command is of the one that was there a cycle ago.

    Members
    -------
    session, sequence : In(16), of a command
    opens : In(1), its session becomes that of the board, which expects 1
    advances : In(1), the next number is expected
    is_open : Out(1), there is a session
    current, expected : Out(16), it and the number
    own : Out(1), the command is of it
    next : Out(1), and has the number that is expected
    before : Out(1), or one of the 2**15 before it
    """

    session: Signal
    sequence: Signal
    opens: Signal
    advances: Signal
    is_open: Signal
    current: Signal
    expected: Signal
    own: Signal
    next: Signal
    before: Signal

    def __init__(self):
        super().__init__({
            **dict.fromkeys(("session", "sequence"), In(SEQUENCE_BITS)),
            **dict.fromkeys(("opens", "advances"), In(1)),
            **dict.fromkeys(("current", "expected"), Out(SEQUENCE_BITS)),
            **dict.fromkeys(("is_open", "own", "next", "before"), Out(1)),
        })

    def elaborate(self, platform):
        m = Module()

        ahead = Signal(SEQUENCE_BITS)
        m.d.comb += ahead.eq(self.sequence - self.expected)
        m.d.sync += [
            self.own.eq(self.is_open & (self.session == self.current)),
            self.next.eq(self.sequence == self.expected),
            self.before.eq(ahead[-1]),
        ]
        with m.If(self.opens):
            m.d.sync += [self.is_open.eq(1), self.current.eq(self.session), self.expected.eq(1)]
        with m.Elif(self.advances):
            m.d.sync += self.expected.eq(self.expected + 1)
        return m
