"""hdl.rays.triangle and folded, as Verilog, bit for bit against sim.model, at their corners."""

import os

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge
from numba import njit

from hdl.fp.format import F24, FloatFormat
from hdl.rays.folded import FoldedIntersect
from hdl.rays.triangle import Intersect
from hdl.rays.turns import TURNS
from sim.cosim.verilate import simulator
from sim.model.rays.overflow import TRIANGLES, no_overflows
from sim.model.rays.setup import AXIS_Z, ORIGIN, SHEAR_X, setup
from sim.model.rays.triangle import intersect_bits
from tests.harness import SideBySide, run_cocotb, unbuilt
from tests.hdl.rays.triangles import anything, grid, inside
from tests.payloads import pack
from tests.pipeline import check_columns
from tests.streams import put, start

FORMATS = {"tiny": FloatFormat(3, 3), "f24": F24}
UNITS = {"whole": (Intersect, 1), "folded": (FoldedIntersect, TURNS)}
CASES = {"tiny": 20000, "f24": 6000}
SIMULATED = CASES if simulator() == "verilator" else {"tiny": 900, "f24": 300}


@njit(cache=True)
def _intersect(exp_bits, man_bits, rows, triangles):
    sheared = np.empty((3, 3), np.int64)
    found = np.empty((len(rows), 5), np.int64)
    for k in range(len(rows)):
        overflows = no_overflows()
        hit, t, u, v = intersect_bits(exp_bits, man_bits, rows[k], triangles[k], sheared, overflows)
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = hit, t, u, v
        found[k, 4] = overflows[TRIANGLES]
    return found


def cases(fmt: FloatFormat, rng, count: int) -> tuple[dict, dict, np.ndarray]:
    """Columns of `count` tests in and out of an Intersect, in random order, and their overflows."""
    parts = [make(fmt, rng, count // 3) for make in (grid, inside, anything)]
    shuffle = rng.permutation(sum(len(part[0]) for part in parts))
    origins, directions, triangles = (np.concatenate(x)[shuffle] for x in zip(*parts, strict=True))
    rows = setup(fmt, origins, directions)
    # A unit that forgets a factor that is always the same is caught by others.
    strange = rng.random(len(rows)) < 0.1
    rows[strange, SHEAR_X : SHEAR_X + 3] = rng.integers(0, 1 << fmt.bits, (strange.sum(), 3))
    sources = {"ray.axis": rows[:, AXIS_Z], "ray.t_min": rng.integers(0, 1 << fmt.bits, len(rows))}
    for k, axis in enumerate("xyz"):
        sources[f"ray.origin.{axis}"] = rows[:, ORIGIN + k]
        sources[f"ray.shear.{axis}"] = rows[:, SHEAR_X + k]
        sources |= {f"v{v}.{axis}": triangles[:, v, k] for v in range(3)}
    *results, overflow = _intersect(fmt.exp_bits, fmt.man_bits, rows, triangles).T
    return sources, dict(zip(("hit", "t", "u", "v"), results, strict=True)), overflow


async def compare(dut, count, idle, busy):
    name = os.environ["FORMAT"]
    fmt = FORMATS[name]
    *both, _ = cases(fmt, np.random.default_rng(cocotb.RANDOM_SEED), CASES[name])
    hits = both[1]["hit"].mean()
    assert 0.2 < hits < 0.6, f"{hits} of the tests are hits"
    both = [{field: column[:count] for field, column in columns.items()} for columns in both]
    assert 0 < both[1]["hit"].sum() < count
    make, turns = UNITS[os.environ["UNIT"]]
    await check_columns(dut, name, unbuilt(make(fmt)), fmt, *both, idle, busy, turns)


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def equals_model(dut):
    await compare(dut, SIMULATED[os.environ["FORMAT"]], 0.0, 0.0)


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("idle", "busy"), [(0.3, 0.0), (0.0, 0.5), (0.4, 0.4)]))
async def waits(dut, idle, busy):
    await compare(dut, SIMULATED[os.environ["FORMAT"]] // 10, idle, busy)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def flags(dut):
    """Each test by itself, beside operands that overflow and are none."""
    name = os.environ["FORMAT"]
    fmt, (make, turns) = FORMATS[name], UNITS[os.environ["UNIT"]]
    unit = unbuilt(make(fmt))
    sources, _, overflow = cases(fmt, np.random.default_rng(cocotb.RANDOM_SEED), CASES[name])
    inputs = pack(unit.i.payload.shape(), fmt, sources)
    i, o = f"{name}__i", f"{name}__o"
    await start(dut, **{f"{i}__valid": 0, f"{o}__ready": 1})
    some = [np.flatnonzero(overflow == k)[:60].tolist() for k in range(2)]
    for quiet, loud in zip(*some, strict=True):
        for row in (quiet, loud):
            await put(dut, i, [inputs[row]])
            getattr(dut, f"{i}__payload").value = inputs[loud]
            seen = 0
            for _ in range(unit.latency + turns):
                await RisingEdge(dut.clk)
                seen |= int(getattr(dut, f"{name}__overflow").value)
            assert seen == overflow[row], f"payload {inputs[row]:x}"


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("name", FORMATS)
def test_equals_model(name, unit, tmp_path, seed):
    make, _ = UNITS[unit]
    alone = SideBySide({name: make(FORMATS[name])})
    run_cocotb(alone, __name__, tmp_path, seed=seed, FORMAT=name, UNIT=unit)


@pytest.mark.parametrize("unit", UNITS)
def test_refuses_formats_without_differences(unit):
    make, _ = UNITS[unit]
    with pytest.raises(ValueError, match="2,4"):
        make(FloatFormat(2, 4))
