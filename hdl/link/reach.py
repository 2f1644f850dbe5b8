"""Whether what a command names is there."""

from amaranth import *
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

SCOPE = data.StructLayout({
    "address": 32,
    "count": 16,
    "first": 8,
    "bytes": 8,
    "registers": 1,
})
"""`count` words from `address` on, of each `bytes` bytes from `first` on; or that many registers,
for which `first` and `bytes` mean nothing."""


class Reach(wiring.Component):
    """Says of a scope whether all of it exists, and it is not of no words or of no bytes.

    Takes `latency` cycles.

    Parameters
    ----------
    words : int
    word_bytes : int
    registers : int

    Members
    -------
    i : In(SCOPE)
    good : Out(1)
    """

    latency = 2
    i: data.View
    good: Signal

    def __init__(self, *, words: int, word_bytes: int, registers: int):
        self.words, self.word_bytes, self.registers = words, word_bytes, registers
        super().__init__({"i": In(SCOPE), "good": Out(1)})

    def elaborate(self, platform):
        m = Module()
        scope = self.i
        width = max(self.words, self.registers).bit_length()
        # stage 1: where it ends
        end = Signal(max(width, len(scope.count)) + 1, reset_less=True)
        past = Signal(len(scope.bytes) + 1, reset_less=True)
        some, near, registers = (
            Signal(name=name, reset_less=True) for name in ("some", "near", "registers")
        )
        m.d.sync += [
            near.eq(scope.address[width:] == 0),  # else the first one is not there
            end.eq(scope.address[:width] + scope.count),
            past.eq(scope.first + scope.bytes),
            some.eq((scope.count != 0) & (scope.registers | (scope.bytes != 0))),
            registers.eq(scope.registers),
        ]
        # stage 2: compare
        m.d.sync += self.good.eq(
            some
            & near
            & (end <= Mux(registers, self.registers, self.words))
            & (registers | (past <= self.word_bytes))
        )
        return m
