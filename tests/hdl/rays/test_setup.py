"""hdl.rays.setup, as Verilog, bit for bit against sim.model.rays.setup."""

import os

import cocotb
import numpy as np
import pytest

from hdl.config import Config
from hdl.fp.format import F24, FloatFormat
from hdl.rays.packet import RAYS
from hdl.rays.setup import Setup
from sim.cosim.verilate import simulator
from sim.model.fp.format import encode
from sim.model.rays.setup import (
    AXIS_Z,
    ORIGIN,
    SHEAR_X,
    margin_scale,
    setup,
)
from tests.harness import one_of, run_cocotb, unbuilt
from tests.hdl.fp.operands import operands
from tests.hdl.rays.scenes import SLAB
from tests.hdl.rays.triangles import grid, inside
from tests.payloads import difference, pack
from tests.streams import collect, now, put, start, take

CONFIGS = {
    "smallest": Config(FloatFormat(2, 1), packets=1),
    "tiny": Config(FloatFormat(3, 2), packets=3),
    "f24": Config(F24),
    "objects": Config(FloatFormat(4, 3), packets=4, instances=True),
}
COUNT = 150 if simulator() == "verilator" else 20  # packets of each class


def canonical(fmt: FloatFormat, x: np.ndarray) -> np.ndarray:
    """Patterns with no mantissa in zeros and infinities."""
    exponent = x >> fmt.man_bits & (1 << fmt.exp_bits) - 1
    special = (exponent == 0) | (exponent == (1 << fmt.exp_bits) - 1)
    return np.where(special, x >> fmt.man_bits << fmt.man_bits, x)


def cases(config: Config, rng, margin: int, level: int = 0) -> dict[str, tuple[list, list]]:
    """For each stream, its layout, and its payloads by the model."""
    fmt = config.fmt
    count = RAYS * COUNT
    anything = operands(fmt, rng, 6, count // 3)
    parts = [grid(fmt, rng, count), inside(fmt, rng, count), (anything[:, :3], anything[:, 3:])]
    origins, directions = (np.concatenate([part[k] for part in parts]) for k in range(2))
    packets = len(origins) // RAYS
    shuffle = rng.permutation(len(origins))[: packets * RAYS]
    origins, directions = canonical(fmt, origins[shuffle]), canonical(fmt, directions[shuffle])
    t_min, t_max = rng.integers(0, 1 << fmt.bits, (2, len(origins)))
    rows = setup(fmt, origins, directions, margin)
    of_packets = rng.integers(0, config.packets, packets)
    packet, number = of_packets.repeat(RAYS), np.tile(np.arange(RAYS), packets)

    def by_axis(name, x):
        return {f"{name}.{a}": x[:, k] for k, a in enumerate("xyz")}

    columns = {
        "i": {"number": number, "ray.t_min": t_min, "ray.t_max": t_max}
        | by_axis("ray.origin", origins)
        | by_axis("ray.direction", directions),
        "i_packets": of_packets,
        "o_rays": {"packet": packet, "number": number, "t_max": t_max, "ray.t_min": t_min}
        | {"ray.axis": rows[:, AXIS_Z]}
        | by_axis("ray.origin", rows[:, ORIGIN:])
        | by_axis("ray.shear", rows[:, SHEAR_X:]),
        "o_starts": {"packet": of_packets}
        | {f"intervals.{k}.near": t_min[k::RAYS] for k in range(RAYS)}
        | {f"intervals.{k}.far": t_max[k::RAYS] for k in range(RAYS)},
        "o_slabs": {"packet": packet.repeat(3), "number": number.repeat(3)}
        | {"axis": np.tile(np.arange(3), len(rows))}
        | {f"ray.{name}": rows[:, column : column + 3].ravel() for name, column in SLAB.items()},
    }
    if config.instances:
        columns |= {"i_objects": {"packet": packet, **columns["i"]}}
        halves = {"packet": packet.repeat(2), "number": number.repeat(2)}
        halves |= {"second": np.tile([0, 1], len(rows))}
        halves |= {"half.t": np.stack([t_min, t_max], axis=1).ravel()}
        for k, a in enumerate("xyz"):
            points = np.stack([origins[:, k], directions[:, k]], axis=1)
            halves[f"half.point.{a}"] = points.ravel()
        columns |= {"o_worlds": halves}
        for port in ("o_rays", "o_starts", "o_slabs"):
            columns[port]["level"] = np.full(len(columns[port]["packet"]), level)
    unit = unbuilt(Setup(config))
    packets_given = {"i_packets": (None, columns.pop("i_packets").tolist())}
    layouts = {port: getattr(unit, port).payload.shape() for port in columns}
    return packets_given | {
        port: (layouts[port], pack(layouts[port], fmt, columns[port])) for port in columns
    }


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((
    ("idle", "slow"),
    [(0.0, ""), (0.3, "o_rays"), (0.0, "o_starts"), (0.0, "i_packets")],
))
async def equals_model(dut, idle, slow):
    name = os.environ["CONFIG"]
    config = CONFIGS[name]
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    margin = int(encode(config.fmt, rng.random())) if idle else margin_scale(config.fmt)
    streams = cases(config, rng, margin)
    packets = len(streams["o_starts"][1])
    if slow:
        packets //= 10
    per_packet = {"o_rays": RAYS, "o_slabs": 3 * RAYS, "o_starts": 1}
    await start(
        dut,
        **{f"{name}__margin": margin},
        **{f"{name}__{port}__valid": 0 for port in ("i", "i_packets")},
        **({f"{name}__i_objects__valid": 0} if config.instances else {}),
        **{f"{name}__{port}__ready": 0 for port in ("o_rays", "o_starts")},
    )
    cocotb.start_soon(put(dut, f"{name}__i", streams["i"][1][: RAYS * packets], idle))
    wait = 0.97 if slow == "i_packets" else 0.0
    cocotb.start_soon(put(dut, f"{name}__i_packets", streams["i_packets"][1][:packets], wait))
    begin = now()
    cycles = {port: [] for port in per_packet}
    counts = {port: packets * per_packet[port] for port in per_packet}

    def taken(port):
        busy = 0.9 if port == slow else 0.0
        return take(dut, f"{name}__{port}", counts[port], busy, cycles[port])

    slabs = collect(dut, f"{name}__o_slabs", counts["o_slabs"], cycles["o_slabs"])
    tasks = {port: cocotb.start_soon(taken(port)) for port in ("o_rays", "o_starts")}
    tasks["o_slabs"] = cocotb.start_soon(slabs)
    for port, task in tasks.items():
        layout, expected = streams[port]
        for k, got in enumerate(await task):
            assert got == expected[k], (
                f"{port} {k}: {difference(config.fmt, layout, got, expected[k])}"
            )
    for k in range(packets):  # a packet starts after all else of it
        assert cycles["o_starts"][k] > cycles["o_rays"][RAYS * k + RAYS - 1]
        assert cycles["o_starts"][k] > cycles["o_slabs"][3 * RAYS * k + 3 * RAYS - 1]
    if not slow:
        assert set(np.diff(cycles["o_starts"])) == {3 * RAYS}
        last_ray = 2 + 3 * (RAYS - 1)  # the first one waits until its number is seen
        assert cycles["o_starts"][0] - begin == last_ray + unbuilt(Setup(config)).latency


@cocotb.test(timeout_time=10, timeout_unit="ms")
@cocotb.parametrize((
    ("idle", "busy", "numbers"),
    [(0.0, 0.0, True), (0.95, 0.3, True), (0.0, 0.0, False)],
))
async def objects_go_first(dut, idle, busy, numbers):
    """Packets of the world and of objects, each in their order, and never mixed."""
    name = os.environ["CONFIG"]
    config = CONFIGS[name]
    if not config.instances:
        return
    rng = np.random.default_rng(cocotb.RANDOM_SEED)
    margin = margin_scale(config.fmt)
    of_level = [cases(config, rng, margin, level) for level in range(2)]
    packets = len(of_level[0]["o_starts"][1])
    await start(
        dut,
        **{f"{name}__margin": margin},
        **{f"{name}__{port}__valid": 0 for port in ("i", "i_packets", "i_objects")},
        **{f"{name}__{port}__ready": 0 for port in ("o_rays", "o_starts")},
    )
    objects = put(dut, f"{name}__i_objects", of_level[1]["i_objects"][1], idle)
    cocotb.start_soon(objects)
    cocotb.start_soon(put(dut, f"{name}__i", of_level[0]["i"][1]))
    if numbers:
        cocotb.start_soon(put(dut, f"{name}__i_packets", of_level[0]["i_packets"][1]))
    count = packets * (1 + numbers)
    tasks = {
        "o_rays": take(dut, f"{name}__o_rays", RAYS * count, busy),
        "o_starts": take(dut, f"{name}__o_starts", count, busy),
        "o_slabs": collect(dut, f"{name}__o_slabs", 3 * RAYS * count),
    }
    if numbers:
        tasks["o_worlds"] = collect(dut, f"{name}__o_worlds", 2 * RAYS * packets)
    tasks = {port: cocotb.start_soon(task) for port, task in tasks.items()}
    found = {port: await task for port, task in tasks.items()}
    if numbers:
        assert found.pop("o_worlds") == of_level[0]["o_worlds"][1]
    per_packet = {"o_rays": RAYS, "o_slabs": 3 * RAYS, "o_starts": 1}
    levels = {}
    for port, words in found.items():
        layout = of_level[0][port][0]
        bits = [word >> layout["level"].offset & 1 for word in words]
        levels[port] = bits[:: per_packet[port]]
        assert bits == np.repeat(levels[port], per_packet[port]).tolist(), f"{port} are mixed"
        for level in range(2):
            got = [word for word, bit in zip(words, bits, strict=True) if bit == level]
            want = of_level[level][port][1] if level or numbers else []
            assert got == want, f"{port} of level {level}"
    assert levels["o_rays"] == levels["o_starts"] == levels["o_slabs"]
    if numbers and not idle:
        assert not any(levels["o_starts"][packets:]), "objects go first"
    elif numbers:
        assert any(levels["o_starts"][packets:]), "both are under way"


@pytest.mark.parametrize("name", CONFIGS)
def test_equals_model(name, tmp_path, seed):
    run_cocotb(one_of(Setup, CONFIGS, name), __name__, tmp_path, seed=seed, CONFIG=name)
