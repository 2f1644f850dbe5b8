"""A serial port over TCP."""

import socket

from sim.errors import InputError


class TcpPort:
    """Takes clients, one after the other. Bytes for nobody are lost, as on a cable unplugged.

    A context manager: the port is closed with it.

    Parameters
    ----------
    host : str
    port : int
        0 for one that is free.

    Attributes
    ----------
    path : str
        As pyserial's serial_for_url takes it.

    Raises
    ------
    InputError
        The address cannot be had.
    """

    def __init__(self, host: str, port: int):
        try:
            self._listener = socket.create_server((host, port), backlog=1)
        except OSError as error:
            raise InputError(f"--tcp {host}:{port}: {error}; give another port, or 0") from error
        self._listener.setblocking(False)
        self._client: socket.socket | None = None
        self.path = f"socket://{host}:{self._listener.getsockname()[1]}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._drop()
        self._listener.close()

    def fileno(self) -> int:
        """What select() waits for."""
        return (self._client or self._listener).fileno()

    def read(self, most: int) -> bytes:
        """Bytes that have come; none if none, and where a client came or went."""
        if not self._client:
            self._take()
            return b""
        try:
            found = self._client.recv(most)
        except BlockingIOError:
            return b""
        except OSError:
            found = b""
        if not found:
            self._drop()
        return found

    def write(self, given: bytes) -> int:
        """Hand on bytes; how many of the first there was room for."""
        if not self._client:
            return len(given)
        try:
            return self._client.send(given)
        except BlockingIOError:
            return 0
        except OSError:
            self._drop()
            return len(given)

    def _take(self):
        try:
            self._client, _ = self._listener.accept()
        except OSError:  # it has gone again
            return
        self._client.setblocking(False)
        self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _drop(self):
        if self._client:
            self._client.close()
            self._client = None
