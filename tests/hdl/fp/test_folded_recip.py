"""hdl.fp.folded_recip, as Verilog, bit for bit against sim.model.fp.recip."""

import random

import cocotb
import numpy as np
from cocotb.triggers import RisingEdge

from hdl.fp.folded_recip import TURNS, FoldedRecip
from hdl.fp.format import Rounding
from sim.model.fp.recip import recip
from tests.harness import SideBySide, run_cocotb, unbuilt
from tests.hdl.fp.test_rounded import near_one
from tests.hdl.fp.unit import UNITS, columns_of
from tests.payloads import float_difference
from tests.streams import start

FORMATS = {name: fmt for name, (fmt, rounding) in UNITS.items() if rounding == Rounding.NEAREST} | {
    "uneven": UNITS["uneven_down"][0]
}


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(name=list(FORMATS))
async def equals_model(dut, name):
    fmt = FORMATS[name]
    columns = columns_of(fmt, np.random.default_rng(cocotb.RANDOM_SEED), 1, near_one, False)
    inputs, expected = columns[0].tolist(), recip(fmt, *columns, Rounding.NEAREST).tolist()
    latency = unbuilt(FoldedRecip(fmt)).latency
    await start(dut, **{f"{name}__takes": 0})
    takes, i, o = (
        getattr(dut, f"{name}__{port}") for port in ("takes", "i__payload", "o__payload")
    )
    for cycle in range(TURNS * len(inputs) + latency):
        takes.value = cycle % TURNS == 0
        index, turn = divmod(cycle, TURNS)
        here = turn == 0 and index < len(inputs)
        i.value = inputs[index] if here else random.getrandbits(fmt.bits)
        await RisingEdge(dut.clk)
        taken = (cycle - latency) // TURNS
        if taken >= 0:
            got, want = o.value.to_unsigned(), expected[taken]
            assert got == want, f"1 / {inputs[taken]:x}: {float_difference(fmt, got, want)}"


def test_equals_model(tmp_path, seed):
    units = SideBySide({name: FoldedRecip(fmt) for name, fmt in FORMATS.items()})
    run_cocotb(units, __name__, tmp_path, seed=seed)
