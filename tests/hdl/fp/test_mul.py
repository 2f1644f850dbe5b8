"""hdl.fp.mul, as Verilog, against sim.model.fp.mul."""

import cocotb
import numpy as np

from hdl.fp.mul import Mul
from sim.model.fp.mul import mul
from tests.harness import SideBySide, run_cocotb
from tests.hdl.fp.unit import UNITS, check, columns_of
from tests.sim.model.fp.operands import near_mul


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(name=list(UNITS), stalls=[(0.0, 0.0), (0.3, 0.5)])
async def equals_model(dut, name, stalls):
    fmt, rounding = UNITS[name]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    columns = columns_of(fmt, rng, 2, near_mul, any(stalls))
    expected = mul(fmt, *columns, rounding)
    await check(dut, name, Mul.latency, fmt, fmt, columns, expected, *stalls)


def test_equals_model(tmp_path, seed):
    units = SideBySide({name: Mul(*parameters) for name, parameters in UNITS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed)
