"""Reliable commands to a board, over a pipe that is not."""

import secrets
import time
from collections.abc import Callable, Iterable, Sequence

from hdl.link import protocol
from hdl.link.protocol import BODY_BYTES, MAGIC, VERSION, Kind
from host.link import split
from host.link.errors import LinkError
from host.link.frames import Frame, Packed
from host.link.line import Line, Pipe, Statistics
from host.link.roundtrip import RoundTrip
from host.link.transfer import Session, Transfer
from host.link.window import Command

WINDOW = 16 << 10
"""Bytes under way: more than a line at 3 Mbaud takes while a USB adapter holds back an answer."""
PATIENCE = 10.0
"""Seconds without a byte from the board."""
OPENING, TRY = 1.2, 0.2
"""Seconds for a session to open, and from one HELLO to the next."""
ANSWERS = {kind.value for kind in (Kind.OK, Kind.REFUSED, Kind.REPEAT)}
HELLO, HELLO_ANSWER = Packed(protocol.HELLO), Packed(protocol.HELLO_ANSWER)

Progress = Callable[[int], None]


def silently(_: int):
    """Progress that nobody is told of."""


class Channel:
    """Reads and writes memory and registers of a board: all of it, once, or an error.

    The first command opens a session, and so does the first one after an error.

    Parameters
    ----------
    pipe : Pipe
    name : str
        Of the port, for what is said of it.
    window : int
        Bytes under way.
    patience, opening : float
        Seconds to wait for a sign of life, in a session and for one.
    clock : callable
        Seconds.

    Raises
    ------
    LinkError
        Of every command: no board answers, or not this version of the protocol.
    Refused, SessionLost
        Of every command: by the board.
    """

    def __init__(
        self,
        pipe: Pipe,
        *,
        name: str = "the port",
        window: int = WINDOW,
        patience: float = PATIENCE,
        opening: float = OPENING,
        clock: Callable[[], float] = time.monotonic,
    ):
        self.name = name
        self._line = Line(pipe, name, clock)
        self._window, self._patience, self._opening = window, patience, opening
        self._session: Session | None = None
        self._most = BODY_BYTES

    @property
    def statistics(self) -> Statistics:
        """Of the line."""
        return self._line.statistics

    def open(self):
        """Open a session.

        Two, one after the other: if the first has the number of the board's session by chance,
        the board goes on with that, and takes its first commands for repeated ones.
        """
        self._session = None
        chance = secrets.randbits(16)
        self._hello(chance)
        other = chance ^ (1 + secrets.randbelow(0xFFFF))
        self._hello(other)
        self._session = Session(other)
        self._round_trip = RoundTrip(self._patience / 2, self._window)

    def _hello(self, session: int):
        line = self._line
        begun = said = line.clock()
        received = line.statistics.bytes_received
        # Frames of a host that is gone may come before it: their answers show a board at work.
        while line.clock() < min(said + self._opening, begun + self._patience):
            line.send(Frame(Kind.HELLO.value, session, 0, HELLO.pack(version=VERSION)), anew=True)
            tried = line.clock()
            while line.clock() < tried + TRY:
                for frame in line.receive():
                    if self._opens(frame, session):
                        return
                    if frame.kind in ANSWERS:
                        said = line.clock()
        received = line.statistics.bytes_received - received
        if received and said == begun:
            raise LinkError(
                f"{self.name}: no board: {received} bytes came, and no answer in them; is this the "
                f"board's port, and --baud its speed?"
            )
        raise LinkError(f"{self.name}: no board answers; is it on, and this its port?")

    def _opens(self, frame: Frame, session: int) -> bool:
        kind, right = Kind.OK.value, len(frame.body) >= HELLO_ANSWER.size
        if (frame.kind, frame.session, frame.sequence) != (kind, session, 0) or not right:
            return False
        answer = HELLO_ANSWER.unpack(frame.body)
        if answer["magic"] != MAGIC:
            raise LinkError(f"{self.name}: what answers is no board; choose another --port")
        if answer["version"] != VERSION:
            raise LinkError(
                f"{self.name}: the board speaks version {answer['version']} of the protocol, and "
                f"this host version {VERSION}; use a host and a board of one release"
            )
        self._most = min(BODY_BYTES, answer["body_bytes"])
        return True

    def read(
        self, address: int, count: int, first: int, size: int, progress: Progress = silently
    ) -> bytes:
        """Of `count` memory words `size` bytes each, from byte `first` on."""
        return self.gather([(address, count)], first, size, progress)

    def gather(
        self,
        runs: Iterable[tuple[int, int]],
        first: int,
        size: int,
        progress: Progress = silently,
    ) -> bytes:
        """The same of runs of words, given by address and count, one after the other."""
        commands = split.reads(runs, first, size, self._most)
        return b"".join(self._run(commands, progress))

    def write(
        self,
        runs: Iterable[tuple[int, bytes]],
        first: int,
        size: int,
        progress: Progress = silently,
    ):
        """Write `size` bytes of words, from byte `first` on, in runs of words from an address."""
        self._run(split.writes(runs, first, size, self._most), progress)

    def peek(self, register: int, count: int) -> list[int]:
        """Registers, counted from offset 0."""
        return split.numbers(b"".join(self._run(split.peeks(register, count, self._most))))

    def poke(self, *runs: tuple[int, Sequence[int]]):
        """Write registers: runs of values from a register on, in their order."""
        self._run(split.pokes(runs, self._most))

    def _run(self, commands: Iterable[Command], progress: Progress = silently) -> list[bytes]:
        """The bodies of the answers, in the order of the commands."""
        if self._session is None:
            self.open()
        session, self._session = self._session, None  # gone, if this fails
        assert session
        answers: dict[int, bytes] = {}

        def done(index: int, command: Command, body: bytes):
            answers[index] = body
            progress(command.moves)

        Transfer(self._line, session, self._round_trip, commands, done, self._patience).run()
        self._session = session
        return [answers[index] for index in range(len(answers))]
