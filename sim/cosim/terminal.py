"""A pseudo-terminal: a serial port for programs of this machine."""

import os
import struct
import sys

from sim.errors import InputError

if sys.platform != "win32":
    import fcntl
    import termios
    import tty


class Terminal:
    """One end of a pseudo-terminal whose other end programs open, one after the other.

    A context manager: the terminal goes with it. What no program has read waits for the next one.
    What a program has written is lost when it, or the next one, flushes its output, as at a port.

    Attributes
    ----------
    path : str
        Of the other end.
    """

    def __init__(self):
        if sys.platform == "win32":
            raise InputError("--pty: this system has no pseudo-terminals; use --tcp PORT")
        # The other end stays open here, so that a program may close it and another open it.
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
        fcntl.ioctl(self._ours, termios.TIOCPKT, struct.pack("i", 1))  # say when there is a flush
        self.path = os.ttyname(self._theirs)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self._ours)
        os.close(self._theirs)

    def fileno(self) -> int:
        """What select() waits for."""
        return self._ours

    def read(self, most: int) -> bytes:
        """Bytes that have come; none if none."""
        packet = self._packet(most)
        if packet[:1] and packet[0] & termios.TIOCPKT_FLUSHWRITE:
            while self._packet(1 << 16):
                pass
            return b""
        return packet[1:]

    def _packet(self, most: int) -> bytes:
        """A byte that is 0 before data, or says what happened; none if nothing did."""
        try:
            return os.read(self._ours, 1 + most)
        except BlockingIOError:
            return b""

    def write(self, given: bytes) -> int:
        """Hand on bytes; how many of the first there was room for."""
        try:
            return os.write(self._ours, given)
        except BlockingIOError:
            return 0
