"""Moves bytes between a port and a simulated board, and lets the board's time pass meanwhile."""

import select
import socket
import time
from collections.abc import Callable
from typing import Protocol

from sim.cosim.board import SimulatedBoard
from sim.cosim.line import DEPTH

SHORT = 256
"""Cycles between two looks at the port after an answer, doubled at each look: a client that answers
an answer is heard soon, and a long run is seldom interrupted."""
LONG = 0.02
"""Seconds between two looks at most."""
AHEAD = 20_000
"""Cycles' worth of bytes that the line is given ahead: a client that follows waits no longer."""


class Port(Protocol):
    """What a client is at the other end of."""

    def fileno(self) -> int:
        """What select() waits for."""
        ...

    def read(self, most: int) -> bytes:
        """Bytes that have come; none if none."""
        ...

    def write(self, given: bytes) -> int:
        """Hand on bytes; how many of the first there was room for."""
        ...


class Pump:
    """Bytes to and from a board.

    Its time stands still, at no cost, while it is idle and no bytes come, and while the client
    does not read what there is for it: no byte is lost.

    Parameters
    ----------
    board : SimulatedBoard
    port : Port

    Attributes
    ----------
    given, received : int
        Bytes that the board was given, and that came from it.
    """

    def __init__(self, board: SimulatedBoard, port: Port):
        self.board = board
        self.port = port
        self.given = self.received = 0
        self._unread = b""  # from the board, not yet by the client
        self._slice = SHORT

    def run(self, stop: socket.socket, tick: Callable[[], None] = lambda: None):
        """Go on until something can be read from `stop`. Calls `tick` after each piece of work."""
        while True:
            waits = self.board.idle or self._unread
            room = self._room()
            takes = [self.port] if room and not self._unread else []
            gives = [self.port] if self._unread else []
            ready, *_ = select.select([stop, *takes], gives, [], None if waits else 0)
            if stop in ready:
                return
            if self._unread:
                self._hand_on()
                continue
            came = self.port.read(room) if self.port in ready else b""
            if came or not self.board.idle:
                self._advance(came)
                tick()

    def _room(self) -> int:
        """Bytes that the line takes now."""
        ahead = int(AHEAD / self.board.byte_cycles)
        return max(0, min(self.board.room, self.board.room - DEPTH + ahead))

    def _advance(self, came: bytes):
        begun = time.perf_counter()
        result = self.board.exchange(came, self._slice)
        if result.received and result.cycles < self._slice:  # an answer, and all of it
            self._slice = SHORT
        elif time.perf_counter() - begun < LONG / 2:
            self._slice *= 2
        self.given += len(came)
        self.received += len(result.received)
        self._unread = result.received
        if self._unread:
            self._hand_on()

    def _hand_on(self):
        self._unread = self._unread[self.port.write(self._unread) :]
