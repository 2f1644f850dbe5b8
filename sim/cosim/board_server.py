"""Inside the simulator of a board: moves bytes over its line, as the other end of a socket asks."""

import signal

import cocotb
from cocotb.simtime import get_sim_time
from cocotb.triggers import RisingEdge, SimTimeoutError, with_timeout

from sim.cosim.line import BULK, DEPTH, Exchange
from sim.cosim.server import CYCLE, answer


def now() -> int:
    """Cycles since the clock began."""
    return int(get_sim_time("ns")) // CYCLE


async def reset(dut):
    """Reset board and line; the words in memory stay."""
    dut.push.value = 0
    dut.pull.value = 0
    dut.rst.value = 1
    for _ in range(3):  # one edge is not enough for Icarus under a gpi clock
        await RisingEdge(dut.clk)
    dut.rst.value = 0
    await RisingEdge(dut.clk)


async def exchange(dut, given: bytes, cycles: int) -> Exchange:
    """Give bytes to the line and let time pass, until an answer has ended, all is idle, or so long.

    The line has room for the bytes. Takes some cycles more where bytes come or go, and none at all
    if all is idle and no bytes are given.
    """
    begun, received = now(), b""
    if given:
        await _push(dut, given)
    elif dut.idle.value:
        return Exchange(b"", 0, 0, _number(dut.framing_errors), True)
    stopped = False
    while not stopped and (left := begun + cycles - now()) > 0:
        try:  # the line holds what can come meanwhile
            await with_timeout(RisingEdge(dut.stop), min(left, DEPTH - BULK) * CYCLE, "ns")
            stopped = True
        except SimTimeoutError:
            pass
        await RisingEdge(dut.clk)
        received += await _pull(dut)
    waiting, errors = _number(dut.waiting), _number(dut.framing_errors)
    return Exchange(received, now() - begun, waiting, errors, bool(dut.idle.value))


def _number(signal) -> int:
    return signal.value.to_unsigned()


async def _push(dut, given: bytes):
    for first in range(0, len(given), BULK):
        some = given[first : first + BULK]
        dut.push.value = len(some)
        dut.push_bytes.value = int.from_bytes(some, "little")
        await RisingEdge(dut.clk)
    dut.push.value = 0
    await RisingEdge(dut.clk)  # all else has seen them by now


async def _pull(dut) -> bytes:
    bulks = -(-_number(dut.received) // BULK)
    found = []
    for bulk in range(bulks + 1 if bulks else 0):
        dut.pull.value = bulk < bulks
        await RisingEdge(dut.clk)
        if bulk:  # what was pulled a cycle ago
            count = _number(dut.pulled)
            found.append(_number(dut.pull_bytes).to_bytes(BULK, "little")[:count])
    return b"".join(found)


CALLS = {call.__name__: call for call in (reset, exchange)}


@cocotb.test()
async def serve(dut):
    """Serve the calls of sim.cosim.board, until the process that makes them has ended."""
    for number in (signal.SIGINT, signal.SIGTERM):  # a terminal sends them to all, but they are its
        signal.signal(number, signal.SIG_IGN)
    await answer(dut, CALLS)
