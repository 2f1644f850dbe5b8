"""hdl.rays.triangle and folded, as Verilog, bit for bit against sim.model, at their corners."""

import os

import cocotb
import numpy as np
import pytest
from numba import njit

from hdl.fp.format import F24, FloatFormat
from hdl.rays.folded import FoldedIntersect
from hdl.rays.triangle import Intersect
from hdl.rays.turns import TURNS
from sim.cosim.verilate import simulator
from sim.model.rays.overflow import no_overflows
from sim.model.rays.setup import AXIS_Z, ORIGIN, SHEAR_X, setup
from sim.model.rays.triangle import intersect_bits
from tests.harness import SideBySide, run_cocotb, unbuilt
from tests.hdl.rays.triangles import anything, grid, inside
from tests.pipeline import check_columns

FORMATS = {"tiny": FloatFormat(3, 3), "f24": F24}
UNITS = {"whole": (Intersect, 1), "folded": (FoldedIntersect, TURNS)}
CASES = {"tiny": 45000, "f24": 9000}
SIMULATED = CASES if simulator() == "verilator" else {"tiny": 900, "f24": 300}


@njit(cache=True)
def _intersect(exp_bits, man_bits, rows, triangles):
    sheared, unseen = np.empty((3, 3), np.int64), no_overflows()
    found = np.empty((len(rows), 4), np.int64)
    for k in range(len(rows)):
        hit, t, u, v = intersect_bits(exp_bits, man_bits, rows[k], triangles[k], sheared, unseen)
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = hit, t, u, v
    return found


def cases(fmt: FloatFormat, rng, count: int) -> tuple[dict, dict]:
    """`count` rows of columns in and out of an Intersect, in random order."""
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
    results = _intersect(fmt.exp_bits, fmt.man_bits, rows, triangles)
    return sources, dict(zip(("hit", "t", "u", "v"), results.T, strict=True))


async def compare(dut, count, idle, busy):
    name = os.environ["FORMAT"]
    fmt = FORMATS[name]
    both = cases(fmt, np.random.default_rng(cocotb.RANDOM_SEED), CASES[name])
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
