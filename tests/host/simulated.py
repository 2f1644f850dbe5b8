"""A way from a host to the Verilog of a board, in a time that goes by as it is simulated."""

from sim.cosim.board import SimulatedBoard
from tests.host.line import BadLine

WAIT = 0.01
"""Seconds that a read in vain takes."""


class SimulatedPipe:
    """A pipe to a simulated board.

    Parameters
    ----------
    board : SimulatedBoard
    up, down : BadLine, optional
        To the board, and from it.
    cycles : int
        Simulated in a read, at most.
    """

    def __init__(
        self,
        board: SimulatedBoard,
        up: BadLine | None = None,
        down: BadLine | None = None,
        cycles: int = 4000,
    ):
        self.board, self.cycles = board, cycles
        self.up, self.down = up or BadLine(0), down or BadLine(0)
        self._given, self._came = bytearray(), bytearray()
        self._waited = 0.0

    def clock(self) -> float:
        """Seconds."""
        return self._waited + self.board.cycles / self.board.clock_hz

    def write(self, data: bytes, /) -> int:
        """To the board."""
        self._given += self.up.carry(bytes(data))
        return len(data)

    def read(self, size: int, /) -> bytes:
        """From the board, as a port with a timeout."""
        if not self._came:
            some = bytes(self._given[: self.board.room])
            del self._given[: len(some)]
            self._came += self.down.carry(self.board.exchange(some, self.cycles).received)
            if self.board.idle and not self._came and not self._given:
                self._waited += WAIT
        read = bytes(self._came[:size])
        del self._came[:size]
        return read

    @property
    def in_waiting(self) -> int:
        """Bytes that are there."""
        return len(self._came)
