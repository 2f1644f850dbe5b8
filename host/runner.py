"""Runs of a board: started, waited for, stopped."""

import time
from collections.abc import Callable

from hdl.registers import CONTROL, Outcome
from host.link.errors import LinkError
from host.registers import ENDINGS, RegisterMap, Status

START, STOP = CONTROL.const({"start": 1}).as_bits(), CONTROL.const({"stop": 1}).as_bits()
LONGEST_PAUSE = 0.05
"""Seconds between two looks at a run, at most."""
STOPPING = 5.0
"""Seconds that a run takes to stop, at most."""


class RunError(LinkError):
    """A run did not come to its end: says why."""


class Runner:
    """Runs jobs on a board, one after the other.

    Parameters
    ----------
    registers : RegisterMap
    name : str
        Of the port, for what is said of it.
    """

    def __init__(self, registers: RegisterMap, name: str):
        self._registers, self._name = registers, name
        self._idle = False  # known to be

    def run(self, job: dict, most_cycles: int) -> dict:
        """Run a job, given by the fields of hdl.core.frame_job. All counters of the board.

        Raises
        ------
        RunError
            The memory fails it, it is stopped, or takes more cycles of the board's clock.
        """
        self.settle()
        self._idle = False
        begun = self._registers.values("CYCLES")["CYCLES"]
        self._registers.start(job, START)
        status = self._wait(begun, most_cycles)
        self._idle = True
        if status.outcome != Outcome.COMPLETE:
            raise RunError(f"{self._name}: the run did not end well: {ENDINGS[status.outcome]}")
        return self._registers.counters()

    def settle(self):
        """Stop the run that is under way, if one may be."""
        if not self._idle:
            self.stop()

    def stop(self) -> bool:
        """Stop the run that is under way; whether one was."""
        was_busy = self._registers.status().busy
        if was_busy:
            self._registers.control(STOP)
            end = time.monotonic() + STOPPING
            self._poll(lambda status: time.monotonic() > end)
        self._idle = True
        return was_busy

    def _wait(self, begun: int, most_cycles: int) -> Status:
        """Until it is not busy. Cycles are counted, so that slow and simulated boards have time."""
        cycles, last = 0, begun

        def late(status: Status) -> bool:
            nonlocal cycles, last
            cycles += (status.cycles - last) % (1 << 32)
            last = status.cycles
            return cycles > most_cycles

        try:
            return self._poll(late)
        except RunError:
            self._registers.control(STOP)
            raise RunError(
                f"{self._name}: a run did not end within {most_cycles:,} cycles and was stopped"
            ) from None

    def _poll(self, late: Callable[[Status], bool]) -> Status:
        pause = 0.0
        while (status := self._registers.status()).busy:
            if late(status):
                raise RunError(f"{self._name}: a run does not stop; reset the board")
            time.sleep(pause)
            pause = min(LONGEST_PAUSE, 1.5 * pause + 0.001)
        return status
