"""Commands through a line that loses, damages and repeats: go-back-N."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from hdl.link.protocol import Kind, Reason
from host.link.errors import LinkError, Refused, SessionLost
from host.link.frames import Frame
from host.link.line import Line
from host.link.roundtrip import RoundTrip
from host.link.window import NUMBERS, Command, Flight, Window

STUCK = 4
"""Timeouts without an answer, though bytes come, after which to send again."""
VAIN = 3
"""Patiences without an answer, though bytes come, after which to give up."""


@dataclass
class Session:
    """A session of a board: its number, and the number of the next command."""

    number: int
    next: int = 1


class Transfer:
    """Sends commands that all change something, or none does, and gathers their answers.

    Parameters
    ----------
    line : Line
    session : Session
    round_trip : RoundTrip
    commands : iterable of Command
    done : callable
        Told the index of each command, in whatever order they end, it, and the answer's body.
    patience : float
        Seconds to wait for a sign of life.
    """

    def __init__(
        self,
        line: Line,
        session: Session,
        round_trip: RoundTrip,
        commands: Iterable[Command],
        done: Callable[[int, Command, bytes], None],
        patience: float,
    ):
        self._line, self._session, self._round_trip = line, session, round_trip
        self._commands = enumerate(commands)
        self._next = next(self._commands, None)
        self._done, self._patience = done, patience
        self._window = Window()
        self._went_back_for: int | None = None  # expected number; until the next answer
        self._begun = self._progress = self._sent = line.clock()

    def run(self):
        """Send all commands and return when all are answered.

        Raises
        ------
        Refused, SessionLost
            By the board.
        LinkError
            There is no board any more.
        """
        while self._next or self._window:
            while self._window.has_room(self._round_trip.window) and self._send():
                if self._line.waiting:
                    break
            for frame in self._line.receive():
                if frame.session == self._session.number:
                    self._take(frame)
            if self._window:
                self._look_at_clock()

    def _send(self) -> bool:
        """Send what is to go again, or else the next command; whether there was any."""
        if flight := self._window.due():
            self._line.send(flight.frame, anew=True)
            self._line.statistics.retransmissions += 1
            self._window.sent_again(flight)
            self._sent = self._line.clock()
            return True
        number = self._session.next
        if not self._next or self._window.is_far(number):
            return False
        (index, command), self._next = self._next, next(self._commands, None)
        self._session.next = (number + 1) % NUMBERS
        frame = Frame(command.kind.value, self._session.number, number, command.body)
        self._line.send(frame)
        self._sent = self._line.clock()
        self._window.add(Flight(index, command, frame, self._sent))
        return True

    def _take(self, answer: Frame):
        flight = self._window.get(answer.sequence)
        if answer.kind == Kind.REPEAT.value and self._window:
            self._repeat(answer.sequence)
        elif answer.kind == Kind.REFUSED.value and flight:
            self._refused(flight.command, answer.body)
        elif answer.kind == Kind.OK.value and flight:
            self._check(flight.command, answer)
            if flight.sends == 1:
                self._round_trip.timed(self._line.clock() - flight.sent)
            earlier = self._window.before(answer.sequence)
            if flight.command.changes:
                for other in earlier:
                    self._end(other)
            self._end(flight, answer.body)
            if not flight.command.changes:  # answers come in order: the earlier ones are lost
                self._window.again(other for other in earlier if other.sends == 1)

    def _repeat(self, expected: int):
        """The board has executed all before a number, and missed it, or was sent damage."""
        if not self._window.holds(expected, self._session.next):
            return  # an old one
        for flight in self._window.before(expected):
            if flight.command.changes:
                self._end(flight)
        if self._window and self._went_back_for != expected:
            self._round_trip.lost()
            self._window.again(self._window)
            self._went_back_for = expected

    def _check(self, command: Command, answer: Frame):
        if len(answer.body) != command.answer:
            raise LinkError(
                f"{self._line.name}: {len(answer.body)} bytes answer a {command.kind.name}, not "
                f"{command.answer}; reset the board"
            )

    def _refused(self, command: Command, body: bytes):
        code = body[0] if body else 0
        reason = Reason(code) if code in {reason.value for reason in Reason} else code
        if reason == Reason.SESSION:
            raise SessionLost(
                f"{self._line.name}: the board was reset, or another host has taken it; begin again"
            )
        raise Refused(f"{self._line.name}: {command.kind.name}", reason)

    def _end(self, flight: Flight, body: bytes = b""):
        self._window.end(flight)
        self._progress, self._went_back_for = self._line.clock(), None
        self._round_trip.answered(flight.command.size)
        self._done(flight.index, flight.command, body)

    def _look_at_clock(self):
        """Send again what is not answered; give up where nothing comes back."""
        now, timeout = self._line.clock(), self._round_trip.timeout
        silent = now - max(self._line.heard, self._begun)
        vain = now - self._progress
        if silent > self._patience or vain > VAIN * self._patience:
            raise LinkError(
                f"{self._line.name}: no answer for {max(silent, vain):.0f} s; is the board on, and "
                f"connected?"
            )
        quiet = now - max(self._line.heard, self._sent)
        if quiet > timeout or now - max(self._progress, self._sent) > STUCK * timeout:
            self._round_trip.back_off()
            self._window.again(self._window)
            self._sent = now
