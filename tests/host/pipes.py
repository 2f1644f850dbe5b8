"""Ways from a host to a board model: in memory with a clock of its own, or a pseudo-terminal."""

import os
import re
import select
import socket
import threading
import tty

from tests.host.board import BoardModel
from tests.host.line import BadLine

WAIT = 0.01
"""Seconds that a read waits."""


class Wire:
    """A pipe in memory, in a time that goes by only while somebody waits.

    Parameters
    ----------
    board : BoardModel
    up, down : BadLine, optional
        To the board, and from it.
    rate : float
        Bytes a second, each way.
    delay : float
        Seconds, each way.
    speed, room : bytes a second that the board works at, and that can wait for it
    """

    def __init__(
        self,
        board: BoardModel,
        up: BadLine | None = None,
        down: BadLine | None = None,
        rate: float = 300_000.0,
        delay: float = 0.008,
        speed: float = 1e9,
        room: int = 1 << 30,
    ):
        self.speed, self.room, self._board_free = speed, room, 0.0
        self.board, self.rate, self.delay = board, rate, delay
        self.up, self.down = up or BadLine(0), down or BadLine(0)
        self.now = 0.0
        self.most_under_way = 0
        self.gone = False
        self._to_board: list[tuple[float, bytes]] = []
        self._to_host: list[tuple[float, bytes]] = []
        self._free = [0.0, 0.0]
        self._came = bytearray()

    def clock(self) -> float:
        """Seconds."""
        return self.now

    def write(self, data: bytes, /) -> int:
        """To the board."""
        self._check()
        self._put(0, self._to_board, self.now, self.up.carry(bytes(data)))
        self.most_under_way = max(self.most_under_way, sum(len(d) for _, d in self._to_board))
        return len(data)

    def read(self, size: int, /) -> bytes:
        """From the board, as a port with a timeout."""
        self._check()
        end = self.now + WAIT
        self._deliver(self.now)
        while not self._came and self.now < end:
            times = [queue[0][0] for queue in (self._to_board, self._to_host) if queue]
            self.now = min([*times, end])
            self._deliver(self.now)
        read = bytes(self._came[:size])
        del self._came[:size]
        return read

    @property
    def in_waiting(self) -> int:
        """Bytes that are there."""
        self._check()
        self._deliver(self.now)
        return len(self._came)

    def _check(self):
        if self.gone:
            raise OSError(5, "Input/output error")

    def _put(self, way: int, queue: list, now: float, data: bytes):
        if data:
            self._free[way] = max(now, self._free[way]) + len(data) / self.rate
            queue.append((self._free[way] + self.delay, data))

    def _deliver(self, now: float):
        while self._to_board and self._to_board[0][0] <= now:
            time, data = self._to_board.pop(0)
            waiting = (self._board_free - time) * self.speed
            if waiting + len(data) > self.room:
                data = b"\1\0"  # a frame that found no room
            else:
                self._board_free = time = max(time, self._board_free) + len(data) / self.speed
            for answer in re.findall(rb"[^\0]*\0|[^\0]+", self.board.receive(data)):
                self._put(1, self._to_host, time, self.down.carry(answer))
        while self._to_host and self._to_host[0][0] <= now:
            self._came += self._to_host.pop(0)[1]


class Tcp:
    """A TCP port with a board behind it, for one host after the other. A context manager.

    Attributes
    ----------
    path : str
        Of the port, for pyserial.
    """

    def __init__(self, answer):
        self._answer = answer
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.path = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        while True:
            try:
                connection, _ = self._listener.accept()
            except OSError:
                return
            with connection:
                while data := connection.recv(4096):
                    connection.sendall(self._answer(data))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()


class Terminal:
    """A pseudo-terminal with a board at its other end, in a thread. A context manager.

    Parameters
    ----------
    answer : callable
        Bytes that come of bytes: `BoardModel.receive`, or anything else.

    Attributes
    ----------
    path : str
        Of the port.
    """

    def __init__(self, answer, up: BadLine | None = None, down: BadLine | None = None):
        self._answer = answer
        self._up, self._down = up or BadLine(0), down or BadLine(0)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.path = os.ttyname(self._slave)
        self._stopped, self._stop = os.pipe()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self):
        while True:
            ready = select.select([self._master, self._stopped], [], [])[0]
            if self._stopped in ready:
                break
            try:
                data = os.read(self._master, 4096)
                answer = self._down.carry(self._answer(self._up.carry(data)))
                while answer:
                    answer = answer[os.write(self._master, answer) :]
            except OSError:
                break
        os.close(self._master)

    def unplug(self):
        """The port is gone."""
        if self._slave >= 0:
            os.write(self._stop, b"x")
            os.close(self._slave)
            self._slave = -1
            self._thread.join(timeout=10)
            os.close(self._stop)
            os.close(self._stopped)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.unplug()
