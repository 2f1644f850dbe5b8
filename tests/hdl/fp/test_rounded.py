"""hdl.fp.add, mul and recip, as Verilog, against sim.model.fp: all formats and roundings."""

import os

import cocotb
import numpy as np
import pytest

from hdl.fp.add import Add
from hdl.fp.mul import Mul
from hdl.fp.recip import Recip
from sim.model.fp.add import add
from sim.model.fp.mul import mul
from sim.model.fp.recip import recip
from tests.harness import SideBySide, run_cocotb, unbuilt
from tests.hdl.fp.operands import weighted
from tests.hdl.fp.unit import UNITS, check, columns_of
from tests.sim.model.fp.operands import near_add, near_mul


def near_one(fmt, rng, count):
    """A column of few ones above or below a power of two."""
    (bits,) = weighted(fmt, rng, 1, count)
    keep = (1 << fmt.man_bits) - (1 << rng.integers(0, fmt.man_bits + 1, count))
    ones = (1 << fmt.man_bits) - 1
    mantissa = np.where(rng.random(count) < 0.5, bits & ones & ~keep, bits & ones | keep)
    return (bits & ~ones | mantissa)[np.newaxis]


OPERATIONS = {  # the unit, its model, its operands and what meets their corners
    "add": (Add, add, 2, near_add),
    "mul": (Mul, mul, 2, near_mul),
    "recip": (Recip, recip, 1, near_one),
}


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(name=list(UNITS), stalls=[(0.0, 0.0), (0.3, 0.5)])
async def equals_model(dut, name, stalls):
    unit, model, operands, corners = OPERATIONS[os.environ["OPERATION"]]
    fmt, rounding = UNITS[name]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    columns = columns_of(fmt, rng, operands, corners, any(stalls))
    expected = model(fmt, *columns, rounding)
    latency = unbuilt(unit(fmt, rounding)).latency
    await check(dut, name, latency, fmt, fmt, columns, expected, *stalls)


@pytest.mark.parametrize("operation", OPERATIONS)
def test_equals_model(operation, tmp_path, seed):
    unit = OPERATIONS[operation][0]
    units = SideBySide({name: unit(*parameters) for name, parameters in UNITS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed, OPERATION=operation)
