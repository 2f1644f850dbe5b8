"""Serial ports: which there are, and opening one."""

import os
import socket
from dataclasses import dataclass
from typing import Protocol

import serial
from serial.tools.list_ports import comports
from serial.urlhandler import protocol_socket

from host.link.channel import PATIENCE
from host.link.errors import LinkError
from host.link.line import Pipe

BAUD = 3_000_000
VARIABLE = "BKDTREE_PORT"
READ_TIMEOUT = 0.01
"""Seconds that a read waits for a first byte."""
TCP = "socket://"
MOST_AT_ONCE = 1 << 16
BUSY = ("lock", "busy", "temporarily unavailable", "access is denied")
"""In what operating systems say of a port that another program has open."""


@dataclass(frozen=True)
class PortInfo:
    """A serial port: what to name it by, what it says it is, and of which maker and kind."""

    url: str
    description: str
    hardware: str
    usb: bool


class Port(Pipe, Protocol):
    """A port that is open."""

    def close(self) -> None:
        """Leave it to others."""


class TcpPort(protocol_socket.Serial):
    """A port behind TCP, such as that of bkd-sim board --tcp, that is read by more than a byte."""

    _socket: socket.socket

    @property
    def in_waiting(self) -> int:
        """Bytes that can be read at once."""
        if not super().in_waiting:
            return 0
        return len(self._socket.recv(MOST_AT_ONCE, socket.MSG_PEEK))


def ports() -> list[PortInfo]:
    """The serial ports that there are."""
    return [
        PortInfo(port.device, _known(port.description), _known(port.hwid), port.vid is not None)
        for port in sorted(comports())
    ]


def default_port() -> str:
    """$BKDTREE_PORT, or the only port on USB, or else the only port.

    Raises
    ------
    LinkError
        There are several, or none: says which.
    """
    if os.environ.get(VARIABLE):
        return os.environ[VARIABLE]
    there = ports()
    there = [port for port in there if port.usb] or there
    if len(there) == 1:
        return there[0].url
    found = ", ".join(port.url for port in there)
    raise LinkError(
        f"there are several serial ports: choose one of {found} by --port"
        if there
        else "there is no serial port; connect a board, or name its port by --port"
    )


def open_port(url: str, baud: int) -> Port:
    """Open a port: a device, or any URL that pyserial knows.

    Raises
    ------
    LinkError
        There is none, it is busy, or it is not for this user or speed.
    """
    try:
        port = TcpPort() if url.startswith(TCP) else serial.serial_for_url(url, do_not_open=True)
        port.port, port.baudrate = url, baud
        port.timeout, port.write_timeout = READ_TIMEOUT, PATIENCE
        if "://" not in url:
            port.exclusive = True
        port.open()
        if "://" not in url:  # what a host that is gone has left
            port.reset_output_buffer()
            port.reset_input_buffer()
        return port
    except (OSError, ValueError) as error:
        raise LinkError(f"{url}: {_reason(error, baud)}") from error


def _reason(error: Exception, baud: int) -> str:
    text = str(error).lower()
    if isinstance(error, FileNotFoundError) or "no such file" in text or "cannot find" in text:
        return "there is no such port; bkd-host ports lists them"
    if any(word in text for word in BUSY):
        return "the port is busy: another program has it open; end that first"
    if "permission denied" in text:
        return "this user may not open it; on Linux, add the user to the group dialout"
    if "refused" in text:
        return "nothing listens there; start what is to answer"
    if "baud" in text:
        return f"the port does not go at {baud} baud; choose another --baud"
    return f"cannot be opened: {error}".replace("\n", " ")


def _known(text: str | None) -> str:
    return "" if text in (None, "n/a") else text
