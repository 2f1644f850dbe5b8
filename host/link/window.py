"""Commands under way: what has been sent and is not answered, in the order of their numbers."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from hdl.link.protocol import Kind
from host.link.frames import Frame

NUMBERS = 1 << 16
"""Sequence numbers go modulo this."""
FAR = 1 << 14
"""Most numbers from the first command under way to the next one that is sent."""


@dataclass(frozen=True)
class Command:
    """What to ask of the board: READ, WRITE, PEEK or POKE.

    Attributes
    ----------
    kind : Kind
    body : bytes
    answer : int
        Bytes of the body of the answer.
    moves : int
        Bytes of data, one way or the other.
    """

    kind: Kind
    body: bytes
    answer: int
    moves: int

    @property
    def changes(self) -> bool:
        """It is executed once, and its answer is for all before it too."""
        return self.kind in (Kind.WRITE, Kind.POKE)

    @property
    def size(self) -> int:
        """Bytes that it takes of a window."""
        return max(len(self.body), self.answer)


@dataclass
class Flight:
    """A command that was sent, when, how often, which of all it is, and if it is to go again."""

    index: int
    command: Command
    frame: Frame
    sent: float
    sends: int = 1
    due: bool = False


class Window:
    """The commands under way, by sequence number."""

    def __init__(self):
        self._bytes = 0
        self._flights: dict[int, Flight] = {}

    def __len__(self):
        return len(self._flights)

    def __iter__(self) -> Iterator[Flight]:
        return iter(self._flights.values())

    def get(self, number: int) -> Flight | None:
        """The command of a number, if it is under way."""
        return self._flights.get(number)

    def has_room(self, most: int) -> bool:
        """Something can be sent where `most` bytes may be under way: one command at least can."""
        return self._bytes < max(1, most)

    def is_far(self, number: int) -> bool:
        """A number has to wait for an answer to the first command."""
        return bool(self._flights) and (number - self._first) % NUMBERS >= FAR

    def due(self) -> Flight | None:
        """The first command that is to go again."""
        return next((flight for flight in self if flight.due), None)

    def again(self, flights: Iterable[Flight]):
        """These have been lost, or may be."""
        for flight in flights:
            if not flight.due:
                flight.due = True
                self._bytes -= flight.command.size

    def sent_again(self, flight: Flight):
        """It has gone again."""
        flight.due, flight.sends = False, flight.sends + 1
        self._bytes += flight.command.size

    def holds(self, number: int, following: int) -> bool:
        """A number can be that which the board expects, where `following` is sent next."""
        return (number - self._first) % NUMBERS <= (following - self._first) % NUMBERS

    def before(self, number: int) -> list[Flight]:
        """The commands with numbers below."""
        return [
            flight
            for sequence, flight in self._flights.items()
            if 0 < (number - sequence) % NUMBERS < NUMBERS // 2
        ]

    def add(self, flight: Flight):
        """It has been sent."""
        self._flights[flight.frame.sequence] = flight
        self._bytes += flight.command.size

    def end(self, flight: Flight):
        """It is answered."""
        del self._flights[flight.frame.sequence]
        if not flight.due:
            self._bytes -= flight.command.size

    @property
    def _first(self) -> int:
        return next(iter(self._flights))
