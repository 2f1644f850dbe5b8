"""A pump between a port and a simulated board, that runs beside the test."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from sim.cosim.pump import Pump


@contextmanager
def running(pump: Pump) -> Iterator[Pump]:
    """Run a pump in a thread meanwhile; what it raises fails the test."""
    failures = []
    ours, theirs = socket.socketpair()

    def run():
        try:
            pump.run(theirs)
        except BaseException as error:
            failures.append(error)

    with ours, theirs:
        thread = threading.Thread(target=run)
        thread.start()
        try:
            yield pump
        finally:
            ours.send(b"x")
            thread.join()
    assert not failures, failures
