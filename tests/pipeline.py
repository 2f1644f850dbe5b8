"""Checks a unit with a stream in and a stream out, of fixed latency, against expected payloads."""

import cocotb
import numpy as np

from hdl.fp.format import FloatFormat
from tests.payloads import difference, pack
from tests.streams import now, put, start, take


async def check_pipeline(
    dut,
    name: str,
    latency: int,
    inputs,
    expected,
    explain,
    idle: float = 0.0,
    busy: float = 0.0,
    turns: int = 1,
):
    """Send payloads into stream `i` of a unit; those of its stream `o` have to be as expected.

    Without stalls they come one in `turns` cycles, each `latency` cycles after its input was taken.
    The first one may have to wait for its turn.

    Parameters
    ----------
    explain : function of (index, got, want)
        Says how payloads differ.
    idle, busy : float
        As in put and take.
    """
    i, o = f"{name}__i", f"{name}__o"
    await start(dut, **{f"{i}__valid": 0, f"{o}__ready": 0})
    begin, cycles = now(), []
    cocotb.start_soon(put(dut, i, inputs, idle))
    found = await take(dut, o, len(inputs), busy, cycles)
    for k, (want, got) in enumerate(zip(expected, found, strict=True)):
        assert got == want, explain(k, got, want)
    if not idle and not busy:
        assert set(np.diff(cycles)) == {turns}, f"one in {turns}"
        assert cycles[0] - (begin + turns + latency) in range(turns)


async def check_columns(
    dut,
    name: str,
    unit,
    fmt: FloatFormat,
    sources,
    results,
    idle: float = 0.0,
    busy: float = 0.0,
    turns: int = 1,
):
    """check_pipeline with columns of numbers for the leaves of a unit's payloads."""
    inputs = pack(unit.i.payload.shape(), fmt, sources)
    layout = unit.o.payload.shape()

    def explain(k, got, want):
        return f"payload {k}, {inputs[k]:x}: {difference(fmt, layout, got, want)}"

    expected = pack(layout, fmt, results)
    latency = unit.latency
    await check_pipeline(dut, name, latency, inputs, expected, explain, idle, busy, turns)
