"""The exported Verilog, as exported: on the memory and the processor of cocotbext-axi."""

import os
import random
from pathlib import Path

import cocotb
import numpy as np
import pytest

from fpga.verilog import verilog
from hdl.config import TINY, Config
from hdl.fp.format import FloatFormat
from hdl.registers import Outcome, registers
from hdl.system import System
from sim.cosim import verilate
from sim.prepare import prepare
from sim.scene.load import load_scene
from tests.axi import WARNINGS
from tests.fpga import jobs
from tests.fpga.driver import Driver
from tests.hdl.checked import random_rays, random_view

TOP = "bkd"
CONFIGS = {
    "tiny": (TINY, "waves:8", 24),
    "medium": (
        Config(
            FloatFormat(5, 7), latency=4, address_bits=16, packets=3, stack_depth=16,
            cache_words=16,
        ),
        "waves:50",
        16,
    ),
}  # fmt: skip


def given() -> tuple[int, list[jobs.Run], Config]:
    return jobs.read(Path(os.environ["JOBS"]))


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.5])
async def memory_and_counters_are_those_of_the_model(dut, stalls):
    size, runs, config = given()
    driver = await Driver.begin(dut, config, size, stalls)
    for register in registers(config):
        if register.name != "CYCLES":
            assert await driver.read(register.name) == register.value
    for run in [*runs, *runs]:
        await driver.run(run)


@cocotb.test(timeout_time=20, timeout_unit="ms")
async def streams_are_bursts(dut):
    size, runs, config = given()
    driver = await Driver.begin(dut, config, size, 0.1)
    update, frame, _ = runs
    await driver.run(update)
    assert driver.words_of_bursts(update, "program") > 2
    assert driver.words_of_bursts(update, "nodes", writes=True) > 2
    await driver.run(frame)
    assert driver.words_of_bursts(frame, "rays") > 4
    assert driver.words_of_bursts(frame, "hits", writes=True) > 2


@cocotb.test(timeout_time=20, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.5])
async def an_error_of_the_memory_ends_the_run(dut, stalls):
    size, runs, config = given()
    update, frame, camera = runs
    driver = await Driver.begin(dut, config, size, stalls)
    places = [(update, name, False) for name in ("program", "vertices")]
    places += [(frame, name, False) for name in ("rays", "nodes")]
    places += [(update, "nodes", True), (frame, "hits", True), (camera, "hits", True)]
    for run, region, writes in places:
        faults = driver.ram.write_faults if writes else driver.ram.read_faults
        first, end = run.regions[region]
        if region == "nodes" and not writes:
            first = end - 16  # the root
        else:
            end = first + 16 * random.randrange(1, (end - first) // 16 + 1)
        faults.update(range(first, end))
        await driver.cut_short(run, Outcome.WRITE_ERROR if writes else Outcome.READ_ERROR)
        faults.clear()
        await driver.run(run)


@cocotb.test(timeout_time=40, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.5])
async def a_run_can_be_stopped_anywhere(dut, stalls):
    size, runs, config = given()
    driver = await Driver.begin(dut, config, size, stalls)
    for run in runs:
        cycles = await driver.run(run)
        for _ in range(6):
            await driver.cut_short(run, Outcome.STOPPED, random.randrange(max(1, cycles - 60)))
        await driver.run(run)


@pytest.mark.parametrize("name", ["tiny", pytest.param("medium", marks=pytest.mark.slow)])
def test_exported_file(name, tmp_path, seed):
    config, scene, count = CONFIGS[name]
    rng = np.random.default_rng(seed)
    prepared = prepare(load_scene(scene), config)
    rays = random_rays(rng, config.fmt, count)
    view = random_view(rng, config.fmt, 5, 3)
    jobs.write(tmp_path / "jobs", *jobs.frames(prepared, rays, view, (0, 3, 5)), config)
    text = verilog(System(config), TOP)
    folder = verilate.build_text([text], top=TOP)
    verilate.run(
        folder, __name__, tmp_path, top=TOP,
        COCOTB_RANDOM_SEED=seed, JOBS=tmp_path / "jobs", PYTHONWARNINGS=WARNINGS,
    )  # fmt: skip
