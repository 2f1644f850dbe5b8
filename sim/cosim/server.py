"""Inside the simulator: does what the process at the other end of a socket asks of a bench."""

import os
import socket
from multiprocessing.connection import Connection
from pathlib import Path

import cocotb
from cocotb.clock import Clock
from cocotb.triggers import FallingEdge, RisingEdge, SimTimeoutError, Timer, with_timeout

CYCLE = 10  # ns


def connect() -> Connection:
    """Connection to the process that started the simulator."""
    client = socket.socket(socket.AF_UNIX)
    client.connect(os.environ["BKDTREE_SOCKET"])
    return Connection(client.detach())


async def pulse(signal):
    """Raise a signal, outside of any cycle."""
    signal.value = 1
    await Timer(1, "ns")
    signal.value = 0
    await Timer(1, "ns")


async def reset(dut, latency: int, stall: int, seed: int):
    """Reset bench and stalls; the words in memory stay."""
    dut.latency.value = latency
    dut.stall.value = stall
    dut.seed.value = seed
    dut.i__valid.value = 0
    dut.rst.value = 1
    for _ in range(2):  # one edge is not enough for Icarus under a gpi clock
        await RisingEdge(dut.clk)
    dut.rst.value = 0


async def load(dut, first: int, lines: str):
    """Words, one hexadecimal a line, to memory from word `first` on."""
    Path("load.hex").write_text(lines)
    dut.first.value = first
    dut.last.value = first + lines.count("\n") - 1
    await pulse(dut.load)


async def dump(dut, first: int, count: int) -> str:
    """Words of memory, as `load` takes them."""
    dut.first.value = first
    dut.last.value = first + count - 1
    await pulse(dut.dump)
    lines = Path("dump.hex").read_text().splitlines(keepends=True)
    return "".join(line for line in lines if line[0] not in "@/\n")  # but for addresses, comments


async def start(dut, job: int):
    """Begin a job."""
    await RisingEdge(dut.clk)
    dut.i__payload.value = job
    dut.i__valid.value = 1
    await RisingEdge(dut.clk)
    while not dut.i__ready.value:
        await RisingEdge(dut.clk)
    dut.i__valid.value = 0


async def wait(dut, cycles: int) -> tuple[bool, int]:
    """Whether the job ends within some cycles, and the counters by then."""
    try:
        await with_timeout(FallingEdge(dut.busy), cycles * CYCLE, "ns")
    except SimTimeoutError:
        return False, dut.counters.value.to_unsigned()
    await RisingEdge(dut.clk)  # past the edge at which busy fell, everything has settled
    if dut.outside.value:
        raise RuntimeError("the job used an address outside of the memory")
    return True, dut.counters.value.to_unsigned()


CALLS = {call.__name__: call for call in (reset, load, dump, start, wait)}


async def answer(dut, calls):
    """Start the clock; answer each call that comes over the socket, a name and arguments."""
    with connect() as connection:
        Clock(dut.clk, CYCLE, unit="ns", impl="gpi").start()
        while True:
            try:
                name, arguments = connection.recv()
            except EOFError:
                return
            try:
                result = await calls[name](dut, *arguments)
            except RuntimeError as error:
                result = error
            connection.send(result)


@cocotb.test()
async def serve(dut):
    """Serve the calls of sim.cosim.machine."""
    dut.load.value = 0
    dut.dump.value = 0
    await answer(dut, CALLS)
