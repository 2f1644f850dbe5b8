"""hdl.fp.recip, as Verilog, against sim.model.fp.recip."""

import cocotb
import numpy as np

from hdl.fp.recip import Recip
from sim.model.fp.recip import recip
from tests.harness import SideBySide, run_cocotb
from tests.hdl.fp.operands import weighted
from tests.hdl.fp.unit import UNITS, check, columns_of


def near_one(fmt, rng, count):
    """A column of few ones above or below a power of two."""
    (bits,) = weighted(fmt, rng, 1, count)
    keep = (1 << fmt.man_bits) - (1 << rng.integers(0, fmt.man_bits + 1, count))
    ones = (1 << fmt.man_bits) - 1
    mantissa = np.where(rng.random(count) < 0.5, bits & ones & ~keep, bits & ones | keep)
    return (bits & ~ones | mantissa)[np.newaxis]


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(name=list(UNITS), stalls=[(0.0, 0.0), (0.3, 0.5)])
async def equals_model(dut, name, stalls):
    fmt, rounding = UNITS[name]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    columns = columns_of(fmt, rng, 1, near_one, any(stalls))
    expected = recip(fmt, *columns, rounding)
    await check(dut, name, Recip(fmt).latency, fmt, fmt, columns, expected, *stalls)


def test_equals_model(tmp_path, seed):
    units = SideBySide({name: Recip(*parameters) for name, parameters in UNITS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed)
