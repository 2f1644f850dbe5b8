"""hdl.update.merge, as Verilog, against the minimum and maximum of sim.model."""

import os
from functools import reduce

import cocotb
import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from hdl.update.merge import AXES, Merge2, Merge3
from sim.model.fp.order import maximum, minimum
from tests.harness import SideBySide, run_cocotb, unbuilt
from tests.hdl.fp.operands import operands
from tests.pipeline import check_columns

FORMATS = {"narrowest": FloatFormat(2, 1), "f24": F24}
UNITS = {"merge3": Merge3, "merge2": Merge2}


def lanes(fmt: FloatFormat, rng, count: int, columns: int) -> list[np.ndarray]:
    """For each of `count` lanes, rows of operands of its own order: lanes do not correlate."""
    return [rng.permutation(operands(fmt, rng, columns, 400)) for _ in range(count)]


def merge3_cases(fmt: FloatFormat, rng):
    """Columns in and out of a Merge3."""
    sources, results = {}, {}
    for axis, rows in zip(AXES, lanes(fmt, rng, 3, 3), strict=True):
        v = list(rows.T)
        sources |= {f"v{k}.{axis}": v[k] for k in range(3)}
        results[f"lo.{axis}"] = reduce(lambda a, b: minimum(fmt, a, b), v)
        results[f"hi.{axis}"] = reduce(lambda a, b: maximum(fmt, a, b), v)
    return sources, results


def merge2_cases(fmt: FloatFormat, rng):
    """Columns in and out of a Merge2."""
    rounds = 4 if fmt.bits * 2 <= 12 else 1  # all pairs of each lane, beside others each round
    lane = zip(*(lanes(fmt, rng, 6, 2) for _ in range(rounds)), strict=True)
    lane = [np.concatenate(parts) for parts in lane]
    axis = rng.integers(0, 3, len(lane[0]))
    sources, results = {"axis": axis}, {}
    for a, name in enumerate(AXES):
        for side, rows, merge in (("lo", lane[a], minimum), ("hi", lane[3 + a], maximum)):
            b0, b1 = rows.T
            sources |= {f"b0.{side}.{name}": b0, f"b1.{side}.{name}": b1}
            results[f"box.{side}.{name}"] = merge(fmt, b0, b1)
            for child, column in (("left", b0), ("right", b1)):
                bound = results.setdefault(f"bounds.{child}_{side}", np.zeros_like(column))
                bound[axis == a] = column[axis == a]
    return sources, results


CASES = {"merge3": merge3_cases, "merge2": merge2_cases}


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(idle=[0.0, 0.3], busy=[0.0, 0.5])
async def equals_model(dut, idle, busy):
    name, unit = os.environ["FORMAT"], os.environ["UNIT"]
    fmt = FORMATS[name]
    component = unbuilt(UNITS[unit](fmt))
    cases = CASES[unit](fmt, np.random.default_rng(cocotb.RANDOM_SEED))
    await check_columns(dut, f"{unit}_{name}", component, fmt, *cases, idle, busy)


@pytest.mark.parametrize("name", FORMATS)
@pytest.mark.parametrize("unit", UNITS)
def test_equals_model(unit, name, tmp_path, seed):
    units = SideBySide({
        f"{unit}_{name}": component(fmt)
        for unit, component in UNITS.items()
        for name, fmt in FORMATS.items()
    })
    run_cocotb(units, __name__, tmp_path, seed=seed, FORMAT=name, UNIT=unit)
