"""What can go wrong between a host and a board: one line each, for a user to read."""

from hdl.link.protocol import Reason


class LinkError(Exception):
    """The board, the line or the port is at fault: says what, and what to do."""


class SessionLost(LinkError):
    """The board has been reset, or another host has taken it."""


class Refused(LinkError):
    """The board refuses a command.

    Attributes
    ----------
    reason : Reason or int
        An int where this version of the protocol knows no such reason.
    """

    def __init__(self, what: str, reason: Reason | int):
        self.reason = reason
        super().__init__(f"{what}: the board refuses it: {WORDS.get(reason, f'reason {reason}')}")


WORDS: dict[Reason | int, str] = {
    Reason.SESSION: "it is of another session",
    Reason.KIND: "it knows no such command",
    Reason.LENGTH: "the command or its answer has the wrong length",
    Reason.RANGE: "words or registers beyond the last one, or bytes beyond a word",
    Reason.MEMORY: "its memory answers with an error",
}
