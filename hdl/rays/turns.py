"""Units of a pipeline that take turns at parts of what comes."""

from amaranth import *
from amaranth.hdl import ValueLike
from amaranth.lib import data

from hdl.fp.folded_recip import TURNS
from hdl.rays.delay import Pipeline, Timed


class Turns(Pipeline):
    """A pipeline whose inputs stay for three turns, and come in parts, one in each.

    The cycle of a value counts from its own turn on, whichever that is.

    Parameters
    ----------
    turn : Signal
        0, 1, 2 and again, always: that of what enters now.
    """

    def __init__(self, turn: Signal):
        super().__init__()
        self.turn = turn
        self._whole = Pipeline()
        self.m.submodules.whole = EnableInserter(turn == TURNS - 1)(self._whole.m)

    def is_turn(self, number: int, cycle: int) -> Value:
        """What is in a cycle of its own has this turn."""
        return self.turn == (number + cycle) % TURNS

    def of_input(self, name: str, value: ValueLike, cycle: int) -> Timed:
        """A value that stays for the three turns of an input, as all three find it in a cycle."""
        if cycle % TURNS:
            raise ValueError(f"{name} is there from a cycle on that {TURNS} divides, not {cycle}")
        of = self._whole.input(name, value)
        return self.steady(name, self._whole.at(of, cycle // TURNS))

    def other(self, x: Timed, turns: int) -> Timed:
        """The value of so many turns later, or earlier if negative: there when both are."""
        name = f"{x.name}_{'before' if turns < 0 else 'after'}"
        if turns < 0:
            return Timed(name, self.at(x, x.cycle - turns), x.cycle)
        return Timed(name, x.value, x.cycle + turns)

    def choose(self, name: str, number: int, one: Timed, others: Timed) -> Timed:
        """One value in a turn, another in the others."""
        cycle = max(one.cycle, others.cycle)
        one_now, others_now = self.at(one, cycle), self.at(others, cycle)
        chosen = Mux(self.is_turn(number, cycle), one_now, others_now)
        if isinstance(one_now, data.View):
            chosen = data.View(one_now.shape(), chosen)
        return Timed(name, chosen, cycle)

    def keep(self, x: Timed) -> Timed:
        """The value of the last turn, for all turns."""
        kept = Signal.like(Value.cast(x.value), name=f"{x.name}_kept", reset_less=True)
        with self.m.If(self.is_turn(TURNS - 1, x.cycle)):
            self.m.d.sync += kept.eq(x.value)
        value = data.View(x.value.shape(), kept) if isinstance(x.value, data.View) else kept
        return Timed(f"{x.name}_kept", value, x.cycle + TURNS)
