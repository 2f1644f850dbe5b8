"""What the two ends of a simulated serial line agree on: its size, and what came of an exchange."""

from typing import NamedTuple

BULK = 256
"""Bytes that are pushed or pulled at once."""
DEPTH = 4096
"""Bytes that wait on each way."""


class Exchange(NamedTuple):
    """What came of an exchange.

    Attributes
    ----------
    received : bytes
    cycles : int
        That have passed.
    waiting : int
        Bytes that the line has not yet sent.
    framing_errors : int
        Bytes from the board without a stop bit, since reset; they are lost.
    idle : bool
        Nothing is under way: with no more bytes, nothing more will come.
    """

    received: bytes
    cycles: int
    waiting: int
    framing_errors: int
    idle: bool
