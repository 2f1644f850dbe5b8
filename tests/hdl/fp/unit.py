"""Checks a float unit, as Verilog, against its model: what the tests of all of them share."""

import numpy as np

from hdl.fp.format import F24, FloatFormat, Rounding
from sim.cosim.verilate import simulator
from tests.payloads import float_difference
from tests.pipeline import check_pipeline
from tests.sim.model.fp.operands import classes, every

TINY = FloatFormat(3, 3)
UNITS = {
    "tiny_nearest": (TINY, Rounding.NEAREST),
    "tiny_down": (TINY, Rounding.DOWN),
    "tiny_up": (TINY, Rounding.UP),
    "f24_nearest": (F24, Rounding.NEAREST),
    "f24_down": (F24, Rounding.DOWN),
    "f24_up": (F24, Rounding.UP),
    "uneven_down": (FloatFormat(2, 9), Rounding.DOWN),
    "wide_nearest": (FloatFormat(8, 23), Rounding.NEAREST),
}
"""Formats and roundings that there are of each unit."""


def columns_of(fmt: FloatFormat, rng, columns: int, corners, stalls: bool) -> np.ndarray:
    """Operands: all of a tiny format, else three classes; fewer with stalls, and on Icarus."""
    icarus = simulator() == "icarus"
    if fmt.bits * columns <= 16:
        rows = rng.permutation(every(fmt, columns), axis=1)
        return rows[:, :300] if stalls or icarus else rows
    count = 100 if icarus or stalls else 1000 if fmt == F24 else 300
    return np.hstack(list(classes(fmt, rng, count, columns, corners).values()))


async def check(dut, name, latency, fmt, to, columns, expected, idle, busy):
    """Compare what unit `name` makes of rows of operands with what its model does.

    Without stalls they come one a cycle, each `latency` cycles after it was taken.
    """
    rows = columns.T.tolist()
    inputs = [sum(x << k * fmt.bits for k, x in enumerate(row)) for row in rows]

    def explain(k, got, want):
        operands = " ".join(f"{x:x}" for x in rows[k])
        return f"{name} of {operands}: {float_difference(to, got, want)}"

    await check_pipeline(dut, name, latency, inputs, expected.tolist(), explain, idle, busy)
