"""Frames over a pipe."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from serial import SerialTimeoutException

from host.link.errors import LinkError
from host.link.frames import Deframer, Frame, encode


class Pipe(Protocol):
    """What carries bytes both ways: an open port of pyserial, or a test's.

    Members
    -------
    in_waiting : bytes that can be read at once
    read : at most `size` bytes, as soon as there are so many or after a short time: 10 ms or so
    write : all bytes; may wait until there is room. Both raise OSError when the pipe is gone.
    """

    @property
    def in_waiting(self) -> int: ...

    def read(self, size: int, /) -> bytes: ...

    def write(self, data: bytes, /) -> int | None: ...


@dataclass
class Statistics:
    """Of a line, from the first byte on."""

    bytes_sent: int = 0
    bytes_received: int = 0
    frames_sent: int = 0
    frames_received: int = 0
    frames_damaged: int = 0
    retransmissions: int = 0


class Line:
    """Sends and receives frames.

    Attributes
    ----------
    name : str
        Of the port, for what is said of it.
    clock : callable
        Seconds.
    heard : float
        When the last byte came.
    statistics : Statistics
    """

    def __init__(self, pipe: Pipe, name: str, clock: Callable[[], float]):
        self.name, self.clock = name, clock
        self.heard = clock()
        self.statistics = Statistics()
        self._pipe, self._deframer = pipe, Deframer()

    def send(self, frame: Frame, *, anew: bool = False):
        """Send a frame; `anew`, after a zero that ends what may have been cut short."""
        encoded = b"\0" * anew + encode(frame)
        try:
            self._pipe.write(encoded)
        except OSError as error:
            raise self._gone(error) from error
        self.statistics.bytes_sent += len(encoded)
        self.statistics.frames_sent += 1

    @property
    def waiting(self) -> bool:
        """There is something to receive at once."""
        try:
            return self._pipe.in_waiting > 0
        except OSError as error:
            raise self._gone(error) from error

    def receive(self) -> list[Frame]:
        """Good frames that have come; waits a little for a first byte."""
        try:
            received = self._pipe.read(max(1, self._pipe.in_waiting))
        except OSError as error:
            raise self._gone(error) from error
        if not received:
            return []
        self.heard = self.clock()
        frames = self._deframer.feed(received)
        self.statistics.bytes_received += len(received)
        self.statistics.frames_received += len(frames)
        self.statistics.frames_damaged = self._deframer.damaged
        return frames

    def _gone(self, error: OSError) -> LinkError:
        if isinstance(error, SerialTimeoutException):
            return LinkError(f"{self.name}: takes no more bytes; is the board on, and listening?")
        return LinkError(f"{self.name}: the port is gone ({error}); connect the board again")
