"""hdl.control, as Verilog: its registers, and runs of a core that the test plays."""

import random
from dataclasses import replace

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.config import FULL, TINY, Config
from hdl.control import Control
from hdl.core import frame_job
from hdl.fp.format import FloatFormat
from hdl.identification import Surroundings, config_of
from hdl.registers import (
    BYTES,
    CONTROL,
    STATUS,
    Access,
    Outcome,
    Register,
    counted,
    registers,
)
from tests.harness import run_cocotb
from tests.payloads import leaves
from tests.streams import now, start

AROUND = Surroundings(words=3000, clock_hz=50_000_000)
COUNTED = counted(TINY)
REGISTERS = {register.name: register for register in registers(TINY, AROUND)}
START, STOP, INTERRUPT = (
    CONTROL.const({name: 1}).as_bits() for name in ("start", "stop", "interrupt")
)
DONE = STATUS.const({"done": 1}).as_bits()


async def begin(dut):
    inputs = ("busy", "read_failed", "write_failed", "counters", "o__ready", "bus__write")
    await start(dut, **dict.fromkeys(inputs, 0), idle=1, bus__address=0)


async def write(dut, name: str, value: int):
    dut.bus__address.value = REGISTERS[name].offset // BYTES
    dut.bus__write_data.value = value
    dut.bus__write.value = 1
    await RisingEdge(dut.clk)
    dut.bus__write.value = 0


async def read(dut, name: str) -> int:
    dut.bus__address.value = REGISTERS[name].offset // BYTES
    for _ in range(2):
        await RisingEdge(dut.clk)
    assert not dut.bus__missing.value
    return dut.bus__read_data.value.to_unsigned()


async def status(dut) -> tuple[int, int, Outcome]:
    await RisingEdge(dut.clk)  # what the test has just set counts
    view = STATUS.from_bits(await read(dut, "STATUS"))
    return view.busy, view.done, view.outcome


async def take_job(dut) -> int:
    """The job that the core takes; it is busy then."""
    dut.o__ready.value = 1
    await RisingEdge(dut.clk)
    while not dut.o__valid.value:
        await RisingEdge(dut.clk)
    job = dut.o__payload.value.to_unsigned()
    dut.o__ready.value = 0
    dut.busy.value = 1
    return job


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def every_register_is_where_the_map_says(dut):
    await begin(dut)
    there = {register.offset // BYTES: register for register in REGISTERS.values()}
    for address in range(1 << len(dut.bus__address)):
        dut.bus__address.value = address
        for _ in range(2):
            await RisingEdge(dut.clk)
        assert bool(dut.bus__missing.value) == (address not in there)
        register = there.get(address)
        if not register or register.name != "CYCLES":
            found = dut.bus__read_data.value
            assert found == (register.value if register else 0), f"{register}"
    assert await read(dut, "MAGIC") == 0x424B4454 and await read(dut, "PACKETS") == TINY.packets
    begun, at = await read(dut, "CYCLES"), now()
    assert await read(dut, "CYCLES") - begun == now() - at


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def job_and_counters_have_a_register_for_each_number(dut):
    await begin(dut)
    jobs = [r for r in REGISTERS.values() if r.access == Access.WRITE]
    written = {r: random.getrandbits(32) for r in jobs}
    for register, word in written.items():
        await write(dut, register.name, word)
    for register, word in written.items():
        assert await read(dut, register.name) == word & (1 << register.width) - 1
    job = dut.o__payload.value.to_unsigned()
    places = {name: (at, width) for name, at, width in leaves(frame_job(TINY), TINY.fmt)}
    assert list(places) == [".".join(r.path) for r in jobs]
    for register, word in written.items():
        at, width = places[".".join(register.path)]
        assert width == register.width and job >> at & (1 << width) - 1 == word & (1 << width) - 1

    bits = random.getrandbits(COUNTED.size)
    dut.counters.value = bits
    counters = [r for r in REGISTERS.values() if r.access == Access.READ and r.path]
    for register, (name, at, width) in zip(counters, leaves(COUNTED, TINY.fmt), strict=True):
        assert name == ".".join(register.path)
        await write(dut, register.name, 5)  # does nothing
        assert await read(dut, register.name) == bits >> at & (1 << width) - 1


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_run_ends_with_done_and_an_interrupt(dut):
    await begin(dut)
    assert await status(dut) == (0, 0, Outcome.COMPLETE)
    for enabled in (0, INTERRUPT):
        await write(dut, "JOB_CAST_HITS", 77)
        await write(dut, "CONTROL", START | enabled)
        assert await read(dut, "CONTROL") == enabled
        assert await status(dut) == (1, 0, Outcome.COMPLETE)
        job = frame_job(TINY).from_bits(await take_job(dut))
        assert job.cast.hits == 77
        await write(dut, "JOB_CAST_HITS", 5)  # for the next run
        await write(dut, "CONTROL", START | enabled)  # while busy: nothing
        await write(dut, "STATUS", DONE)
        assert await status(dut) == (1, 0, Outcome.COMPLETE) and not dut.interrupt.value
        dut.busy.value = 0
        assert await status(dut) == (0, 1, Outcome.COMPLETE)
        assert bool(dut.interrupt.value) == bool(enabled) and not dut.o__valid.value
        await write(dut, "CONTROL", STOP | enabled)  # while not busy: nothing
        await write(dut, "STATUS", DONE ^ STATUS.const({"busy": 1, "outcome": 3}).as_bits() ^ DONE)
        assert await status(dut) == (0, 1, Outcome.COMPLETE)
        await write(dut, "STATUS", DONE)
        assert await status(dut) == (0, 0, Outcome.COMPLETE) and not dut.interrupt.value


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(
    outcome=[Outcome.STOPPED, Outcome.READ_ERROR, Outcome.WRITE_ERROR], taken=[False, True]
)
async def a_run_that_is_cut_short_waits_for_the_memory(dut, outcome, taken):
    await begin(dut)
    dut.idle.value = 0
    await write(dut, "CONTROL", START | INTERRUPT)
    if taken:
        await take_job(dut)
    if outcome == Outcome.STOPPED:
        await write(dut, "CONTROL", STOP | INTERRUPT)
    else:
        signal = dut.read_failed if outcome == Outcome.READ_ERROR else dut.write_failed
        await RisingEdge(dut.clk)
        signal.value = 1
        await RisingEdge(dut.clk)
        signal.value = 0
    for _ in range(9):
        await RisingEdge(dut.clk)
    dut.read_failed.value = 1  # another one: the first counts
    assert dut.hold.value and not dut.o__valid.value
    dut.busy.value = 0  # it is in reset
    assert await status(dut) == (1, 0, outcome)
    dut.read_failed.value = 0
    dut.idle.value = 1
    assert await status(dut) == (0, 1, outcome) and dut.interrupt.value and not dut.hold.value
    await write(dut, "CONTROL", START)
    assert await status(dut) == (1, 0, Outcome.COMPLETE)
    await take_job(dut)
    dut.busy.value = 0
    assert await status(dut) == (0, 1, Outcome.COMPLETE)


def test_contract(tmp_path, seed):
    run_cocotb(Control(TINY, AROUND), __name__, tmp_path, seed=seed)


def test_offsets_do_not_move():
    """Software is compiled with them: a change needs another VERSION."""
    found = {r.name: r.offset for r in registers(FULL)}
    assert found == {r.name: r.offset for r in registers(TINY)}
    known = {
        "MAGIC": 0x000,
        "LATENCY": 0x02C,
        "CLOCK_HZ": 0x034,
        "CONTROL": 0x040,
        "STATUS": 0x044,
        "CYCLES": 0x048,
        "JOB_PROGRAM_ADDRESS": 0x100,
        "JOB_CAST_SCENE_ROOT": 0x118,
        "JOB_CAST_SCENE_MARGIN": 0x11C,
        "JOB_CAST_HITS": 0x170,
        "COUNT_UPDATE_INSTRUCTIONS": 0x200,
        "COUNT_CAST_STEPS": 0x220,
        "COUNT_GEOMETRY_MISSES": 0x250,
        "COUNT_OVERFLOWS_TRIANGLES": 0x264,
        "LINK_FRAMING_ERRORS": 0x300,
    }
    assert known.items() <= found.items() and len(found) == 14 + 3 + 29 + 26 + 4


LESS = [
    {"update": False},
    {"camera": False},
    {"source": False, "pointer_bits": 9},
    {"update": False, "camera": False, "pointer_bits": 2},
]


@pytest.mark.parametrize("less", LESS, ids=str)
def test_what_is_left_out_leaves_its_place(less):
    """All other registers are where the full machine has them; UNITS says what is not."""
    config = replace(TINY, **less)
    whole, found = ({r.name: r for r in registers(c)} for c in (TINY, config))
    gone = sorted(whole.keys() - found)
    parts = {
        "update": ("JOB_PROGRAM_", "COUNT_UPDATE_", "COUNT_OVERFLOWS_UPDATE", "VERTEX_R", "BOX_R"),
        "camera": ("JOB_CAST_CAMERA", "JOB_CAST_IMAGE_", "COUNT_OVERFLOWS_CAMERA"),
        "source": ("JOB_CAST_CAMERA", "JOB_CAST_RAYS_"),
    }
    names = tuple(name for unit in parts if less.get(unit) is False for name in parts[unit])
    assert gone == sorted(name for name in whole if name.startswith(names))
    assert found.keys() - whole == {"UNITS"} and found["UNITS"].offset == 0x38
    assert all(found[name].offset == whole[name].offset for name in found if name in whole)
    bits = config.pointer_bits
    assert found["JOB_CAST_SCENE_ROOT"].width == bits
    assert config_of({r.name: r.value for r in found.values()}) == (
        config if config.update else replace(config, vertex_registers=64, box_registers=64)
    )


@pytest.mark.parametrize("config", [TINY, FULL, Config(FloatFormat(8, 23))])
def test_registers_are_words_one_after_the_other(config):
    found: list[Register] = registers(config)
    offsets = [r.offset for r in found]
    assert offsets == sorted(set(offsets)) and not any(offset % BYTES for offset in offsets)
    assert all(0 < r.width <= 32 and 0 <= r.value < 1 << r.width for r in found)


@pytest.mark.parametrize("config", [TINY, FULL, Config(FloatFormat(8, 23), cache_words=0)])
def test_a_machine_says_what_it_is(config):
    assert config_of({r.name: r.value for r in registers(config)}) == config
