"""A pseudo-terminal: a serial port for programs of this machine."""

import os
import tty

from sim.errors import InputError


class Terminal:
    """One end of a pseudo-terminal whose other end programs open, one after the other.

    A context manager: the terminal goes with it. What no program has read waits for the next one.

    Attributes
    ----------
    path : str
        Of the other end.
    """

    def __init__(self):
        if not hasattr(os, "openpty"):
            raise InputError("--pty: this system has no pseudo-terminals; use --tcp PORT")
        # The other end stays open here, so that a program may close it and another open it.
        self._ours, self._theirs = os.openpty()
        tty.setraw(self._theirs)
        os.set_blocking(self._ours, False)
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
        try:
            return os.read(self._ours, most)
        except BlockingIOError:
            return b""

    def write(self, given: bytes) -> int:
        """Hand on bytes; how many of the first there was room for."""
        try:
            return os.write(self._ours, given)
        except BlockingIOError:
            return 0
