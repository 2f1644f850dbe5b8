"""hdl.fp.order, as Verilog, against sim.model.fp.order."""

import os

import cocotb
import numpy as np
import pytest
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from cocotb.triggers import Timer

from hdl.fp.format import F24, FloatFormat
from hdl.fp.order import less, order_key
from sim.model.fp import order as model
from tests.harness import SideBySide, run_cocotb
from tests.hdl.fp.operands import operands
from tests.payloads import float_difference

FORMATS = {"narrowest": FloatFormat(2, 1), "small": FloatFormat(3, 2), "f24": F24}


class Order(wiring.Component):
    """less(a, b) and order_key(a), each combinational."""

    def __init__(self, fmt: FloatFormat):
        self.fmt = fmt
        super().__init__({
            "a": In(fmt.layout),
            "b": In(fmt.layout),
            "less": Out(1),
            "key": Out(fmt.bits),
        })

    def elaborate(self, platform):
        m = Module()
        m.d.comb += [self.less.eq(less(self.a, self.b)), self.key.eq(order_key(self.a))]
        return m


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def equals_model(dut):
    name = os.environ["FORMAT"]
    fmt = FORMATS[name]
    port_a, port_b, port_less, port_key = (
        getattr(dut, f"{name}__{port}") for port in ("a", "b", "less", "key")
    )
    rows = operands(fmt, np.random.default_rng(cocotb.RANDOM_SEED), columns=2, count=1000)
    keys = model.order_key(fmt, rows)
    for (a, b), (key_a, key_b) in zip(rows.tolist(), keys.tolist(), strict=True):
        port_a.value = a
        port_b.value = b
        await Timer(1, "ns")
        found, expected = int(port_less.value), int(key_a < key_b)
        assert found == expected, f"less is {found} of {float_difference(fmt, a, b)}"
        assert port_key.value.to_unsigned() == key_a + (1 << (fmt.bits - 1)), f"key of {a:x}"


@pytest.mark.parametrize("name", FORMATS)
def test_equals_model(name, tmp_path, seed):
    formats = SideBySide({name: Order(fmt) for name, fmt in FORMATS.items()})
    run_cocotb(formats, __name__, tmp_path, seed=seed, FORMAT=name)
