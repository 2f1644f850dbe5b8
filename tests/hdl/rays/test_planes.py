"""hdl.rays.planes, as Verilog, against sim.model.rays.planes."""

import os

import cocotb
import numpy as np
import pytest

from hdl.fp.format import F24, FloatFormat
from hdl.rays.planes import Planes
from sim.model.fp.order import from_key
from sim.model.rays.overflow import no_overflows
from sim.model.rays.planes import clip_bits
from sim.model.rays.setup import (
    ABOVE,
    BELOW,
    COLUMNS,
    INVERSE_DOWN,
    INVERSE_UP,
    NEGATIVE,
    setup,
)
from tests.harness import one_of, run_cocotb, unbuilt
from tests.hdl.fp.operands import operands, specials, weighted
from tests.pipeline import check_columns

FORMATS = {"narrowest": FloatFormat(2, 1), "tiny": FloatFormat(3, 2), "f24": F24}


def all_cases(fmt: FloatFormat, rng) -> dict[str, np.ndarray]:
    """All operands of `begin` with each inverse, and beside them those of `end`.

    Of the two inverses one is used: each takes all values while the other is random.
    """
    size = 1 << fmt.bits
    pairs = operands(fmt, rng, 2, 0)
    swept, negative, swept_down = (a.ravel() for a in np.mgrid[:size, :2, :2])
    lows, highs = (
        np.concatenate([rng.permutation(pairs) for _ in range(len(swept))]) for _ in range(2)
    )
    swept, negative, swept_down = (a.repeat(len(pairs)) for a in (swept, negative, swept_down))
    other = rng.integers(0, size, len(swept))
    return {
        "low": lows[:, 0], "ray.above": lows[:, 1],
        "high": highs[:, 0], "ray.below": highs[:, 1],
        "ray.inverse_down": np.where(swept_down, swept, other),
        "ray.inverse_up": np.where(swept_down, other, swept),
        "ray.negative": negative,
    }  # fmt: skip


def classes(fmt: FloatFormat, rng) -> dict[str, np.ndarray]:
    """Any numbers; then rays as they are: parallel to the planes, far away, towards and away."""
    any_ray = operands(fmt, rng, 6, 500)
    any_sign = rng.integers(0, 2, len(any_ray))
    count = 3000
    numbers = weighted(fmt, rng, 2 * count, 3)
    numbers[rng.random(len(numbers)) < 0.2, :] = rng.choice(specials(fmt), 3)
    zeros = np.array([0, 1 << (fmt.bits - 1)])
    parallel = rng.random((count, 3)) < 0.2
    directions = np.where(parallel, rng.choice(zeros, (count, 3)), numbers[:count])
    rows = setup(fmt, numbers[count:], directions)
    bounds = operands(fmt, rng, 2, count)[-count:]
    columns = [ABOVE, BELOW, INVERSE_DOWN, INVERSE_UP, NEGATIVE]
    rays = np.concatenate([
        np.concatenate([any_ray[:, 2:], any_sign[:, None]], axis=1),
        rows[:, columns],
    ])
    low, high = np.concatenate([any_ray[:, :2], bounds]).T
    fields = ("above", "below", "inverse_down", "inverse_up", "negative")
    return {"low": low, "high": high} | {
        f"ray.{f}": column for f, column in zip(fields, rays.T, strict=True)
    }


def model(fmt: FloatFormat, cases: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Begin and end of each case: what is left of the longest interval."""
    count, most = len(cases["low"]), 1 << (fmt.bits - 1)
    rows = np.zeros((count, COLUMNS), np.int64)
    for column, name in [
        (ABOVE, "above"), (BELOW, "below"), (INVERSE_DOWN, "inverse_down"),
        (INVERSE_UP, "inverse_up"), (NEGATIVE, "negative"),
    ]:  # fmt: skip
        rows[:, column] = cases[f"ray.{name}"]
    low, high = cases["low"].tolist(), cases["high"].tolist()
    unseen = no_overflows()
    clipped = np.array([
        clip_bits(fmt.exp_bits, fmt.man_bits, rows[k], 0, low[k], high[k], -most, most - 1, unseen)
        for k in range(count)
    ])
    begin, end = from_key(fmt, clipped).T
    return {"begin": begin, "end": end}


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize(idle=[0.0, 0.3], busy=[0.0, 0.5])
async def equals_model(dut, idle, busy):
    name = os.environ["FORMAT"]
    fmt = FORMATS[name]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    cases = all_cases(fmt, rng) if name == "narrowest" else classes(fmt, rng)
    if idle or busy:
        cases = {field: column[-2000:] for field, column in cases.items()}
    unit = unbuilt(Planes(fmt))
    await check_columns(dut, name, unit, fmt, cases, model(fmt, cases), idle, busy)


@pytest.mark.parametrize("name", FORMATS)
def test_equals_model(name, tmp_path, seed):
    run_cocotb(one_of(Planes, FORMATS, name), __name__, tmp_path, seed=seed, FORMAT=name)
