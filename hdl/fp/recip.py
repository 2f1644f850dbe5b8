"""The reciprocal of a float."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.fp.format import FloatFormat, Rounding
from hdl.fp.round import Round

STEPS = 2  # bits of the quotient a stage


class Recip(wiring.Component):
    """1 / a, rounded once. Takes `latency` cycles; one reciprocal a cycle.

    Of zero it is the infinity of its sign, and the other way round. A division that restores
    nothing, unrolled: each bit of the quotient is the sign of a remainder.

    Parameters
    ----------
    fmt : FloatFormat
    rounding : Rounding

    Members
    -------
    i : In(stream of fmt)
    o : Out(stream of fmt), in the order of the inputs

    Attributes
    ----------
    latency : int
        One for two bits of the significand and of the half after it, and one to round.
    """

    i: stream.Interface
    o: stream.Interface

    def __init__(self, fmt: FloatFormat, rounding: Rounding = Rounding.NEAREST):
        self._init(fmt, {"round": rounding}, fmt.layout)

    def _init(self, fmt: FloatFormat, roundings: dict[str, Rounding], result, **ports):
        self.fmt, self.roundings = fmt, roundings
        self.latency = self.latency_of(fmt)
        super().__init__({
            "i": In(stream.Signature(fmt.layout)),
            "o": Out(stream.Signature(result)),
            **ports,
        })

    @staticmethod
    def latency_of(fmt: FloatFormat) -> int:
        """The latency of a Recip."""
        return -(-(fmt.man_bits + 2) // STEPS) + 1

    def elaborate(self, platform):
        m = Module()

        fmt = self.fmt
        step = ~self.o.valid | self.o.ready
        valid = Signal(self.latency - 1)
        m.d.comb += self.i.ready.eq(step)
        with m.If(step):
            m.d.sync += Cat(valid, self.o.valid).eq(Cat(self.i.valid, valid))

        now = self._begin()
        for bit in range(1, fmt.man_bits + 2):
            if bit % STEPS == 0:
                now = self._stage(m, step, now, bit // STEPS)
            self._bit(m, now, f"{bit}")
        now = self._stage(m, step, now, self.latency - 1)

        rounded = self._rounded(m, now)
        with m.If(step):
            m.d.sync += self.o.p.eq(rounded)
        return m

    def _begin(self) -> dict:
        """All that is known of an input."""
        # Without its highest bit, 1 / 2, the quotient leaves 2 - significand: not negative. To the
        # end remainders are between minus and plus the significand.
        a, man_bits = self.i.p, self.fmt.man_bits
        one = ~a.man.any()
        return {
            "sign": a.sign,
            "infinite": ~a.exp.any(),
            "zero": a.exp.all(),
            "exp": (2 * self.fmt.bias - 1 + one - a.exp).as_signed(),
            "one": one,
            "man": a.man,
            "remainder": ((1 << man_bits) - a.man)[: man_bits + 2],
            "quotient": C(0, 0),
        }

    def _bit(self, m: Module, now: dict, number: str):
        """One more bit of the quotient."""
        man_bits = self.fmt.man_bits
        add = now["remainder"][-1]
        twice = Cat(~add, now["remainder"])[: man_bits + 2]
        significand = Cat(now["man"], 1, 0) ^ (~add).replicate(man_bits + 2)
        remainder = Signal(man_bits + 2, name=f"remainder{number}")
        m.d.comb += remainder.eq(twice + significand)
        now["remainder"] = remainder
        now["quotient"] = Cat(~remainder[-1], now["quotient"])

    def _rounded(self, m: Module, now: dict) -> Value:
        """The results, of all bits of the quotient."""
        fmt = self.fmt
        exponents = range(-fmt.bias, 2 * fmt.bias + 1)
        rounded = []
        for name, rounding in self.roundings.items():
            m.submodules[name] = rounder = Round(fmt, rounding, exponents)
            result = rounder.i
            m.d.comb += [
                *(result[field].eq(now[field]) for field in ("sign", "infinite", "zero", "exp")),
                Cat(result.half, result.man).eq(
                    now["quotient"] & (~now["one"]).replicate(fmt.man_bits + 1)
                ),
                result.rest.eq(~now["one"]),
            ]
            rounded.append(rounder.o)
        return Cat(rounded)

    def _stage(self, m: Module, step: Value, now: dict, number: int) -> dict:
        """Registers of all that a stage knows."""
        registers = {
            name: Signal(Value.cast(value).shape(), name=f"s{number}_{name}", reset_less=True)
            for name, value in now.items()
        }
        with m.If(step):
            m.d.sync += [registers[name].eq(value) for name, value in now.items()]
        return registers


class RecipBounds(Recip):
    """The floats on both sides of 1 / a, equal where it is one: `Recip`, rounded down and up.

    Parameters
    ----------
    fmt : FloatFormat

    Members
    -------
    i : In(stream of fmt)
    o : Out(stream of {down, up: fmt}), in the order of the inputs
    """

    def __init__(self, fmt: FloatFormat):
        roundings = {"down": Rounding.DOWN, "up": Rounding.UP}
        self._init(fmt, roundings, data.StructLayout(dict.fromkeys(roundings, fmt.layout)))
