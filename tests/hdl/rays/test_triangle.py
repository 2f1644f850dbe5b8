"""hdl.rays.triangle, as Verilog, bit for bit against sim.model, on rays that meet its corners."""

import os

import cocotb
import numpy as np
import pytest
from numba import njit

from hdl.fp.format import F24, FloatFormat
from hdl.rays.triangle import Intersect
from sim.cosim.verilate import simulator
from sim.model.fp.format import encode
from sim.model.rays.setup import AXIS_Z, ORIGIN, SHEAR_X, setup
from sim.model.rays.triangle import intersect_bits
from tests.harness import SideBySide, difference, now, pack, put, run_cocotb, start, take, unbuilt
from tests.hdl.fp.operands import operands

FORMATS = {"tiny": FloatFormat(3, 3), "f24": F24}
COUNT = {"tiny": 15000, "f24": 3000}
if simulator() == "icarus":
    COUNT = {"tiny": 300, "f24": 60}


def grid(fmt: FloatFormat, rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles and origins on a grid, and rays at corners, edges and insides.

    Many triangles are degenerate, many origins lie on them, many directions have zeros of
    either sign. Some scenes are as large or as small as the format allows.
    """
    triangles = rng.integers(-2, 3, (count, 3, 3)) / 2.0
    origins = rng.integers(-2, 3, (count, 3)) / 2.0
    weights = rng.choice([0.0, 0.0, 0.25, 0.5, 1.0], (count, 3))
    weights[weights.sum(axis=1) == 0] = 1.0
    weights /= weights.sum(axis=1, keepdims=True)
    directions = np.einsum("nk,nka->na", weights, triangles) - origins
    scale = 2.0 ** rng.integers(fmt.min_exp, fmt.max_exp + 1, (3, count, 1))
    scale[:, rng.random(count) < 0.7] = 1.0
    scale[1] = np.where(rng.random((count, 1)) < 0.7, scale[0], scale[1])
    bits = [
        encode(fmt, x * s)
        for x, s in ((origins, scale[0]), (directions, scale[2]), (triangles, scale[1][:, None]))
    ]
    for x in bits:  # zeros of either sign
        x[(x == 0) & (rng.random(x.shape) < 0.5)] = 1 << (fmt.bits - 1)
    return bits[0], bits[1], bits[2]


def inside(fmt: FloatFormat, rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles of any size and place, and rays at about a point of theirs."""
    size = 2.0 ** -rng.integers(0, 12, (count, 1, 1))
    triangles = rng.uniform(-1, 1, (count, 1, 3)) + size * rng.uniform(-1, 1, (count, 3, 3))
    origins = rng.uniform(-1, 1, (count, 3))
    targets = np.einsum("nk,nka->na", rng.dirichlet([0.5] * 3, count), triangles)
    return encode(fmt, origins), encode(fmt, targets - origins), encode(fmt, triangles)


def anything(fmt: FloatFormat, rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Bit patterns: special ones, near each other, and random."""
    x = operands(fmt, rng, 15, count // 3)
    return x[:, :3], x[:, 3:6], x[:, 6:].reshape(-1, 3, 3)


@njit(cache=True)
def _intersect(exp_bits, man_bits, rows, triangles):
    sheared = np.empty((3, 3), np.int64)
    found = np.empty((len(rows), 4), np.int64)
    for k in range(len(rows)):
        hit, t, u, v = intersect_bits(exp_bits, man_bits, rows[k], triangles[k], sheared)
        found[k, 0], found[k, 1], found[k, 2], found[k, 3] = hit, t, u, v
    return found


def cases(fmt: FloatFormat, rng, count: int) -> tuple[dict, dict]:
    """Columns in and out of an Intersect, in random order."""
    parts = [make(fmt, rng, count) for make in (grid, inside, anything)]
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
    fmt, i, o = FORMATS[name], f"{name}__i", f"{name}__o"
    unit = unbuilt(Intersect(fmt))
    sources, results = cases(fmt, np.random.default_rng(cocotb.RANDOM_SEED), count)
    hits = results["hit"].mean()
    assert 0.2 < hits < 0.6, f"{hits} of the tests are hits"
    inputs = pack(unit.i.payload.shape(), fmt, sources)
    layout = unit.o.payload.shape()
    expected = pack(layout, fmt, results)

    await start(dut, **{f"{i}__valid": 0, f"{o}__ready": 0})
    begin = now()
    cocotb.start_soon(put(dut, i, inputs, idle))
    found = await take(dut, o, len(inputs), busy)
    end = now()
    for k, (want, got) in enumerate(zip(expected, found, strict=True)):
        assert got == want, f"test {k}, {inputs[k]:x}: {difference(fmt, layout, got, want)}"
    if not idle and not busy:
        assert end - begin == len(inputs) + unit.latency, "one a cycle"


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def equals_model(dut):
    await compare(dut, COUNT[os.environ["FORMAT"]], 0.0, 0.0)


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("idle", "busy"), [(0.3, 0.0), (0.0, 0.5), (0.4, 0.4)]))
async def waits(dut, idle, busy):
    await compare(dut, COUNT[os.environ["FORMAT"]] // 10, idle, busy)


@pytest.mark.parametrize("name", FORMATS)
def test_equals_model(name, tmp_path, seed):
    run_cocotb(
        SideBySide({name: Intersect(FORMATS[name])}), __name__, tmp_path, seed=seed, FORMAT=name
    )


def test_refuses_formats_without_differences():
    with pytest.raises(ValueError, match="2,4"):
        Intersect(FloatFormat(2, 4))
