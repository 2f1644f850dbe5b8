"""hdl.fp.cross, as Verilog, against sim.model.fp.cross."""

import cocotb
import numpy as np

from hdl.fp.cross import Cross
from hdl.fp.format import F24, FloatFormat
from sim.model.fp.cross import cross
from tests.harness import SideBySide, run_cocotb
from tests.hdl.fp.unit import check, columns_of
from tests.sim.model.fp.operands import near_cross

FORMATS = {
    "tiny": FloatFormat(2, 1),
    "uneven": FloatFormat(4, 9),
    "f24": F24,
    "wide": FloatFormat(8, 23),
}


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(name=list(FORMATS), stalls=[(0.0, 0.0), (0.3, 0.5)])
async def equals_model(dut, name, stalls):
    fmt = FORMATS[name]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    columns = columns_of(fmt, rng, 4, near_cross, any(stalls))
    expected = cross(fmt, *columns)
    await check(dut, name, Cross.latency, fmt, fmt.difference, columns, expected, *stalls)


def test_equals_model(tmp_path, seed):
    units = SideBySide({name: Cross(fmt) for name, fmt in FORMATS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed)
