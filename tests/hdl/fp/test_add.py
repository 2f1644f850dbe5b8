"""hdl.fp.add, as Verilog, against sim.model.fp.add."""

import cocotb
import numpy as np

from hdl.fp.add import Add
from sim.model.fp.add import add
from tests.harness import SideBySide, run_cocotb
from tests.hdl.fp.unit import UNITS, check, columns_of
from tests.sim.model.fp.operands import near_add


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(name=list(UNITS), stalls=[(0.0, 0.0), (0.3, 0.5)])
async def equals_model(dut, name, stalls):
    fmt, rounding = UNITS[name]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    columns = columns_of(fmt, rng, 2, near_add, any(stalls))
    expected = add(fmt, *columns, rounding)
    await check(dut, name, Add.latency, fmt, fmt, columns, expected, *stalls)


def test_equals_model(tmp_path, seed):
    units = SideBySide({name: Add(*parameters) for name, parameters in UNITS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed)
