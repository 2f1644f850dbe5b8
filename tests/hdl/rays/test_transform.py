"""hdl.rays.transform, as Verilog, bit for bit against sim.model.rays.transform."""

import os

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hdl.config import Config
from hdl.fp.format import F24, FloatFormat
from hdl.rays.packet import RAYS
from hdl.rays.transform import Transform
from sim.cosim.verilate import simulator
from sim.model.rays.transform import transform
from tests.harness import one_of, run_cocotb, unbuilt
from tests.hdl.fp.operands import operands
from tests.payloads import difference, pack
from tests.streams import now, put, start, take

CONFIGS = {
    "smallest": Config(FloatFormat(2, 1), packets=1, instances=True),
    "tiny": Config(FloatFormat(3, 2), packets=3, instances=True, pointer_bits=5),
    "f24": Config(F24, instances=True),
}
COUNT = 200 if simulator() == "verilator" else 20  # packets
TURNS = 3  # of a ray


def cases(config: Config, rng) -> dict[str, tuple[object, list]]:
    """For each stream its layout, and its payloads by the model: rays first, of all packets."""
    fmt, packets = config.fmt, config.packets
    rays = {
        name: operands(fmt, rng, 3, RAYS * packets)[: RAYS * packets]
        for name in ("origin", "direction")
    }
    limits = {name: rng.integers(0, 1 << fmt.bits, RAYS * packets) for name in ("t_min", "t_max")}
    number, every = np.tile(np.arange(RAYS), packets), np.arange(packets).repeat(RAYS)
    of = rng.integers(0, packets, COUNT)
    rows = operands(fmt, rng, 12, COUNT)[:COUNT].reshape(-1, 3, 4)
    roots = rng.integers(0, 1 << config.pointer_bits, COUNT)
    seen = [
        transform(fmt, row, *(rays[v][RAYS * packet :][:RAYS] for v in ("origin", "direction")))
        for row, packet in zip(rows, of, strict=True)
    ]
    origins, directions = (np.concatenate(part) for part in zip(*seen, strict=True))
    chosen = (RAYS * of[:, np.newaxis] + np.arange(RAYS)).ravel()

    def by_axis(name, x):
        return {f"{name}.{a}": x[:, k] for k, a in enumerate("xyz")}

    def ray(origin, direction, which):
        numbers = {f"ray.{name}": limit[which] for name, limit in limits.items()}
        return by_axis("ray.origin", origin) | by_axis("ray.direction", direction) | numbers

    everything = np.arange(len(number))
    columns = {
        "i_world": {"packet": every, "number": number}
        | ray(rays["origin"], rays["direction"], everything),
        "i": {"packet": of, "root": roots}
        | {
            f"{a}.{name}": rows[:, k, column]
            for k, a in enumerate("xyz")
            for column, name in enumerate(("x", "y", "z", "offset"))
        },
        "o": {"packet": of.repeat(RAYS), "number": number[chosen], "root": roots.repeat(RAYS)}
        | ray(origins, directions, chosen),
    }
    unit = unbuilt(Transform(config))
    layouts = {port: getattr(unit, port).payload.shape() for port in columns}
    return {port: (layouts[port], pack(layouts[port], fmt, columns[port])) for port in columns}


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((("idle", "busy"), [(0.0, 0.0), (0.97, 0.0), (0.0, 0.9)]))
async def equals_model(dut, idle, busy):
    name = os.environ["CONFIG"]
    streams = cases(CONFIGS[name], np.random.default_rng(cocotb.RANDOM_SEED))
    ports = {port: f"{name}__{port}" for port in streams}
    zero = {f"{ports[port]}__valid": 0 for port in ("i", "i_world")}
    await start(dut, **zero, **{f"{ports['o']}__ready": 0})
    await _fill(dut, streams["i_world"][1], ports["i_world"])
    cocotb.start_soon(put(dut, ports["i"], streams["i"][1], idle))
    begin = now()
    cycles = []
    fmt, (layout, expected) = CONFIGS[name].fmt, streams["o"]
    for k, got in enumerate(await take(dut, ports["o"], len(expected), busy, cycles)):
        assert got == expected[k], f"{k}: {difference(fmt, layout, got, expected[k])}"
    if not (idle or busy):
        assert cycles[0] - begin == 1 + unbuilt(Transform(CONFIGS[name])).latency  # one to offer
        assert set(np.diff(cycles)) <= {TURNS, TURNS + 2}


async def _fill(dut, rays, port):
    """Rays are taken at once."""
    getattr(dut, f"{port}__valid").value = 1
    for word in rays:
        getattr(dut, f"{port}__payload").value = word
        await RisingEdge(dut.clk)
    getattr(dut, f"{port}__valid").value = 0


@pytest.mark.parametrize("name", CONFIGS)
def test_equals_model(name, tmp_path, seed):
    run_cocotb(one_of(Transform, CONFIGS, name), __name__, tmp_path, seed=seed, CONFIG=name)
