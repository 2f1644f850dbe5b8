"""How long to wait for an answer, and how much to send meanwhile."""

FIRST, LEAST = 1.0, 0.05
"""Seconds: while no answer has been timed, and at least."""
BEGINNING = 2 << 10
"""Bytes that are sent before the first answer."""
SLOWLY = 8
"""Windows that have to arrive for one that is a frame wider, where there were losses before."""


class RoundTrip:
    """A timeout that follows the times answers take, and a window that opens with them.

    So a slow line, or a simulated one, is not filled for minutes before it is known to be slow,
    nor a board swamped that takes less at once. (Jacobson and Karels, "Congestion avoidance and
    control", 1988; answers to what was sent twice are not timed, as Karn and Partridge, 1987, say.)

    Parameters
    ----------
    longest : float
        Seconds that the timeout is at most.
    widest : int
        Bytes that the window is at most.

    Attributes
    ----------
    window : int
        Bytes under way, when no more is sent.
    """

    def __init__(self, longest: float, widest: int):
        self._longest, self._widest = longest, widest
        self.window = min(BEGINNING, widest)
        self._safe = widest  # a window up to which it opens fast
        self._mean: float | None = None
        self._deviation = 0.0
        self._factor = 1

    @property
    def timeout(self) -> float:
        """Seconds without a sign of life after which to send again."""
        if self._mean is None:
            usual = FIRST
        else:
            usual = max(LEAST, self._mean + 4 * self._deviation)
        return min(self._longest, self._factor * usual)

    def timed(self, seconds: float):
        """An answer took so long."""
        self._factor = 1
        if self._mean is None:
            self._mean, self._deviation = seconds, seconds / 2
        else:
            self._deviation += (abs(seconds - self._mean) - self._deviation) / 4
            self._mean += (seconds - self._mean) / 8

    def back_off(self):
        """It was in vain: wait twice as long, and send little at once."""
        self._factor *= 2
        self.lost()
        self.window = min(BEGINNING, self._widest)

    def lost(self):
        """Something did not arrive: send half as much at once."""
        self.window = self._safe = max(min(BEGINNING, self._widest), self.window // 2)

    def answered(self, size: int):
        """So many bytes have arrived: the window opens fast where it was, slowly beyond."""
        more = size if self.window < self._safe else size * size // (SLOWLY * self.window)
        self.window = min(self._widest, self.window + more)
