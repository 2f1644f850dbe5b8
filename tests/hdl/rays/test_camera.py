"""hdl.rays.camera, as Verilog, bit for bit against sim.model.rays.camera."""

import os

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hdl.config import Config
from hdl.fp.format import F24, FloatFormat
from hdl.rays.camera import Camera
from hdl.rays.packet import RAYS, pixel_bits
from sim.cosim.verilate import simulator
from sim.model.fp.format import encode
from sim.model.rays.camera import camera
from tests.harness import one_of, run_cocotb, unbuilt
from tests.hdl.fp.operands import weighted
from tests.payloads import difference, pack
from tests.streams import now, put, start, take

CONFIGS = {
    "smallest": Config(FloatFormat(2, 1), packets=1),
    "tiny": Config(FloatFormat(3, 2), packets=3),
    "f24": Config(F24),
}
SIZES = [(1, 1), (2, 3), (3, 2), (6, 5), (1, 7), (7, 1)]
WIDE = [(4001, 1), (1, 1025)]


def cases(config: Config, rng, sizes, bands) -> tuple[dict[str, tuple], list[int]]:
    """For each stream, its layout, and its payloads by the model; and the rays of each image."""
    fmt = config.fmt
    most = (1 << pixel_bits(fmt)) - 1
    rows = {"i": [], "o": []}
    unit = unbuilt(Camera(config))
    layouts = {port: getattr(unit, port).payload.shape() for port in rows}
    counts = []
    for size in sizes:
        width, height = (min(n, most) for n in size)
        vectors = encode(fmt, rng.uniform(-1, 1, (4, 3)))
        if rng.random() < 0.3:
            vectors = weighted(fmt, rng, 4, 3)
        t_min, t_max = rng.integers(0, 1 << fmt.bits, 2)
        top = int(2 * rng.integers((height + 1) // 2)) if bands else 0
        rays = camera(fmt, *vectors, width, height, t_min, t_max, top)
        counts.append(len(rays.pixels))
        names = ("origin", "corner", "right", "down")
        by_axis = {
            f"{name}.{a}": [vector[k]]
            for name, vector in zip(names, vectors, strict=True)
            for k, a in enumerate("xyz")
        }
        limits = {"width": [width], "height": [height], "top": [top]}
        limits |= {"t_min": [t_min], "t_max": [t_max]}
        rows["i"] += pack(layouts["i"], fmt, by_axis | limits)
        columns = {"number": np.arange(len(rays.pixels)) % RAYS}
        columns |= {"ray.t_min": rays.t_min, "ray.t_max": rays.t_max}
        for k, a in enumerate("xyz"):
            columns[f"ray.origin.{a}"] = rays.origins[:, k]
            columns[f"ray.direction.{a}"] = rays.directions[:, k]
        rows["o"] += pack(layouts["o"], fmt, columns)
    return {port: (layouts[port], rows[port]) for port in rows}, counts


async def pulses(clk, signal, cycles: list[int]):
    """Keep the cycles in which a signal is up."""
    while True:
        await RisingEdge(clk)
        if signal.value:
            cycles.append(now())


async def compare(dut, sizes, idle, busy, bands=False):
    name = os.environ["CONFIG"]
    config = CONFIGS[name]
    streams, rays_of_images = cases(config, np.random.default_rng(cocotb.RANDOM_SEED), sizes, bands)
    await start(
        dut,
        **{f"{name}__i__valid": 0, f"{name}__o__ready": 0},
    )
    begin, cycles = now(), []
    given: list[int] = []
    cocotb.start_soon(pulses(dut.clk, getattr(dut, f"{name}__gives"), given))
    cocotb.start_soon(put(dut, f"{name}__i", streams["i"][1], idle))
    layout, expected = streams["o"]
    found = await take(dut, f"{name}__o", len(expected), busy, cycles)
    for k, (got, want) in enumerate(zip(found, expected, strict=True)):
        assert got == want, f"ray {k}: {difference(config.fmt, layout, got, want)}"
    assert len(given) == len(found) // RAYS
    if not idle and not busy:
        expected = []
        for count in rays_of_images:
            begin += 2 + Camera.latency
            expected += range(begin, begin + 3 * count, 3)
            begin = expected[-1]  # the next image comes with the last ray
        assert cycles == expected


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("idle", "busy"), [(0.0, 0.0), (0.9, 0.0), (0.0, 0.8), (0.5, 0.5)]))
async def equals_model(dut, idle, busy):
    await compare(dut, SIZES * 3, idle, busy)


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def all_small_images(dut):
    await compare(dut, [(w, h) for w in range(1, 6) for h in range(1, 6)], 0.0, 0.0)


@cocotb.test(timeout_time=10, timeout_unit="ms")
async def rows_of_an_image(dut):
    await compare(dut, [(w, h) for w in range(1, 5) for h in range(1, 9)] * 2, 0.3, 0.3, bands=True)


@cocotb.test(timeout_time=10, timeout_unit="ms", skip=simulator() == "icarus")
async def wide_and_high(dut):
    await compare(dut, WIDE, 0.0, 0.0)


@pytest.mark.parametrize("name", CONFIGS)
def test_equals_model(name, tmp_path, seed):
    run_cocotb(one_of(Camera, CONFIGS, name), __name__, tmp_path, seed=seed, CONFIG=name)
