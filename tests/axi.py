"""A memory on AXI4 that stalls and fails, and what it is asked."""

import logging
import random
from collections.abc import Iterator
from itertools import count

import cocotb
from cocotb.triggers import RisingEdge
from cocotbext.axi import AxiBus
from cocotbext.axi.axi_ram import AxiRamRead, AxiRamWrite
from cocotbext.axi.sparse_memory import SparseMemory

from tests.streams import now

DEPRECATED = ("stream", "reset", "axi_slave", "axil_master", "utils")
"""Modules of cocotbext.axi that use what cocotb has deprecated."""

WARNINGS = ",".join([
    "error",
    *(f"ignore::DeprecationWarning:cocotbext.axi.{name}" for name in DEPRECATED),
    "ignore::DeprecationWarning:cocotb_bus.bus",
])
"""For PYTHONWARNINGS of tests with cocotbext.axi."""

MASTER_DRIVES = {
    "aw": ("id", "addr", "len", "size", "burst"),
    "w": ("data", "strb", "last"),
    "ar": ("id", "addr", "len", "size", "burst"),
}


def quiet(dut):
    """Not a line of log for each burst."""
    logging.getLogger(f"cocotb.{dut._name}").setLevel(logging.ERROR)


def pauses(share: float) -> Iterator[bool]:
    """For set_pause_generator: pauses in a share of the cycles."""
    while True:
        yield random.random() < share


class Failing:
    """Answers with an error to what touches bytes of the set `faults`; counts them."""

    faults: set[int]
    failures = 0

    def check(self, address: int, length: int):
        """Raise where the memory is at fault; cocotbext.axi makes a SLVERR of it."""
        if not self.faults.isdisjoint(range(address, address + length)):
            self.failures += 1
            raise OSError(f"no memory at {address:x}")


class FailingWrite(Failing, AxiRamWrite):
    """The write half of Ram."""

    async def _write(self, address, data):
        self.check(address, len(data))
        await super()._write(address, data)


class FailingRead(Failing, AxiRamRead):
    """The read half of Ram."""

    async def _read(self, address, length):
        self.check(address, length)
        return await super()._read(address, length)


class Ram:
    """A memory behind an AXI4 master, and a check of what the master drives.

    Parameters
    ----------
    dut
    prefix : str
        Of the names of the master's signals, without the last underscore.
    size : int
        Bytes.
    stalls : float
        Share of the cycles in which each of the five channels waits.

    Attributes
    ----------
    reads, writes : list of (cycle, byte address, words)
        Bursts, by their address.
    read_faults, write_faults : set of byte addresses
        Where the memory answers with an error.
    """

    def __init__(self, dut, prefix: str, size: int, stalls: float = 0.0):
        quiet(dut)
        bus = AxiBus.from_prefix(dut, prefix)
        self.memory = SparseMemory(size)
        self.write_if = FailingWrite(bus.write, dut.clk, dut.rst, mem=self.memory)
        self.read_if = FailingRead(bus.read, dut.clk, dut.rst, mem=self.memory)
        self.read_faults = self.read_if.faults = set()
        self.write_faults = self.write_if.faults = set()
        self.reads: list[tuple[int, int, int]] = []
        self.writes: list[tuple[int, int, int]] = []
        self.stall(stalls)
        bursts = {"ar": self.reads, "aw": self.writes, "w": []}
        for channel, found in bursts.items():
            cocotb.start_soon(self._watch(dut, prefix, channel, found))

    @property
    def failures(self) -> int:
        """Words that were answered with an error."""
        return self.read_if.failures + self.write_if.failures

    def stall(self, share: float):
        """Let each channel wait in a share of the cycles from now on."""
        write, read = self.write_if, self.read_if
        for channel in (
            write.aw_channel, write.w_channel, write.b_channel, read.ar_channel, read.r_channel,
        ):  # fmt: skip
            channel.set_pause_generator(pauses(share) if share else None)
            channel.pause = False

    @staticmethod
    async def _watch(dut, prefix: str, channel: str, bursts: list):
        """What is offered stays as it is until it is taken."""

        def handle(name):
            return getattr(dut, f"{prefix}_{channel}{name}")

        valid, ready = handle("valid"), handle("ready")
        fields = [handle(name) for name in MASTER_DRIVES[channel]]
        waiting = None
        for _ in count():
            await RisingEdge(dut.clk)
            if dut.rst.value or not valid.value:
                assert waiting is None, f"{channel}: valid was withdrawn"
                continue
            offered = [int(field.value) for field in fields]
            assert waiting in (None, offered), f"{channel}: {waiting} became {offered}"
            waiting = None if ready.value else offered
            if ready.value:
                bursts.append((now(), offered[1], offered[2] + 1))
