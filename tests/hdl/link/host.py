"""The other ends of a Link under cocotb: the line, made with packages of others, and registers."""

import random
import struct
import zlib

from cobs import cobs
from cocotb.triggers import RisingEdge

from tests.hdl.link.reference import REGISTERS, Frame
from tests.streams import now


def encode(frame: Frame, *, length: int | None = None) -> bytes:
    """What a frame is on the line. `length` is what its header says, if that is not so."""
    length = len(frame.body) if length is None else length
    sent = struct.pack("<BHHH", frame.kind, frame.session, frame.sequence, length) + frame.body
    return cobs.encode(sent + struct.pack("<I", zlib.crc32(sent))) + b"\0"


def decode(line: bytes) -> Frame:
    """The frame on a line, without its zero byte; it has to be right."""
    sent = cobs.decode(line)
    assert len(sent) >= 11, f"{sent.hex()} is no frame"
    assert struct.pack("<I", zlib.crc32(sent[:-4])) == sent[-4:], "wrong CRC"
    kind, session, sequence, length = struct.unpack("<BHHH", sent[:7])
    assert length == len(sent) - 11, "wrong length"
    return Frame(kind, session, sequence, sent[7:-4])


class Line:
    """Both directions of the line of a Link.

    Parameters
    ----------
    dut
    name : str
        Of the Link in it.
    busy : float
        Chance that a cycle takes no byte; a busy line is ready only after it has seen valid.

    Attributes
    ----------
    answers : list of Frame
    pulses : dict of str to int
        Cycles with `damaged`, `lost` and `executed`.
    last : int
        The last cycle with a byte in either direction, or a pulse.
    """

    def __init__(self, dut, name: str, busy: float = 0.0):
        self.dut, self.name, self.busy = dut, name, busy
        self.answers: list[Frame] = []
        self.pulses = dict.fromkeys(("damaged", "lost", "executed"), 0)
        self.last = 0

    async def send(self, line: bytes, idle: float = 0.0):
        """Send bytes as they are, one a cycle, with gaps in a part `idle` of the cycles."""
        valid, payload = (getattr(self.dut, f"{self.name}__i__{x}") for x in ("valid", "payload"))
        for byte in line:
            while idle and random.random() < idle:
                valid.value = 0
                await RisingEdge(self.dut.clk)
            valid.value = 1
            payload.value = byte
            await RisingEdge(self.dut.clk)
        valid.value = 0
        self.last = now()

    async def run(self):
        """Take answers and count pulses without end."""
        valid, payload, ready = (
            getattr(self.dut, f"{self.name}__o__{x}") for x in ("valid", "payload", "ready")
        )
        pulses = {pulse: getattr(self.dut, f"{self.name}__{pulse}") for pulse in self.pulses}
        line = bytearray()
        willing, waiting = not self.busy, None
        while True:
            ready.value = willing
            await RisingEdge(self.dut.clk)
            for pulse, signal in pulses.items():
                if signal.value == 1:
                    self.pulses[pulse] += 1
                    self.last = now()
            if not valid.value:
                assert waiting is None, "valid was withdrawn"
                willing = not self.busy
                continue
            byte = int(payload.value)
            assert waiting in (None, byte), "a byte changed as it waited"
            waiting = None if willing else byte
            self.last = now()
            if willing and byte:
                line.append(byte)
            elif willing:
                self.answers.append(decode(bytes(line)))
                line.clear()
            willing = random.random() >= self.busy

    async def take(self, count: int = 0, cycles: int = 400) -> list[Frame]:
        """All answers, at least `count`, once nothing has happened for some cycles."""
        while len(self.answers) < count or now() - self.last < cycles:
            await RisingEdge(self.dut.clk)
        answers, self.answers = self.answers, []
        return answers

    async def ask(self, frame: Frame) -> Frame:
        """The one answer to a command."""
        await self.send(encode(frame))
        while not self.answers:
            await RisingEdge(self.dut.clk)
        return self.answers.pop(0)


class Registers:
    """Registers that keep what is written."""

    def __init__(self, dut, name: str, values: list[int]):
        assert len(values) == REGISTERS
        self.dut, self.name, self.values = dut, name, values
        self.writes = 0

    async def run(self):
        """Serve without end."""
        address, write, data, said = (
            getattr(self.dut, f"{self.name}__registers__{x}")
            for x in ("address", "write", "write_data", "read_data")
        )
        while True:
            await RisingEdge(self.dut.clk)
            if not address.value.is_resolvable:  # before the first use
                continue
            at = int(address.value)
            said.value = self.values[at]
            if write.value == 1:
                self.values[at] = int(data.value)
                self.writes += 1
