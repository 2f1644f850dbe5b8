"""The counters of hdl.update.processor, as Verilog, against cycles that the test counts."""

import random

import cocotb
from cocotb.triggers import RisingEdge

from hdl.config import TINY
from hdl.update.processor import COUNTERS, CYCLES, UpdateProcessor, job
from sim.compiler.disassemble import assemble
from sim.cosim.bench import MEMORY_MODEL, Bench
from sim.cosim.server import load, reset
from tests.harness import run_cocotb
from tests.streams import now, put, start

WORDS = 4096
NODES = 1000

FIRST = ["LOAD v0, 0", "LOAD v1, 1", "MERGE3 b0, v0, v1, v0", "MERGE3 b1, v1, v1, v0"]
PROGRAMS = {
    "empty": [],
    "node": ["NODE 3"],
    "dead load": ["LOAD v0, 0"],
    "dead merge": FIRST,
    "write": [*FIRST, "MERGE2 b0, b0, b1, x"],
    "chain": [*FIRST, *["MERGE2 b0, b0, b1, x"] * 30],
    "stream": [*FIRST, *["MERGE2 b2, b0, b1, z"] * 90],
    "loads": [f"LOAD v{k % 5}, {k}" for k in range(50)],
}


async def cycles_of(dut, program: int, length: int) -> int:
    """Cycles for which the processor is busy with a program."""
    await RisingEdge(dut.clk)
    assert dut.i__ready.value and not dut.busy.value
    dut.i__payload.value = job(TINY).const({
        "program": {"address": program, "length": length},
        "vertices": 0,
        "nodes": NODES,
    }).as_bits()  # fmt: skip
    dut.i__valid.value = 1
    await RisingEdge(dut.clk)
    dut.i__valid.value = 0
    begin = now()
    await RisingEdge(dut.clk)
    while dut.busy.value:
        assert not dut.i__ready.value
        await RisingEdge(dut.clk)
    return now() - begin - 1


@cocotb.test(timeout_time=5, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 4, 40], stall=[0, 0.4])
async def counters_add_up_to_the_cycles(dut, latency, stall):
    await start(dut, load=0, dump=0, i__valid=0, latency=latency, stall=0, seed=1)
    await reset(dut, latency, int(stall * 65536), random.randrange(1, 1 << 32))
    await load(dut, 0, "".join(f"{random.getrandbits(128):032x}\n" for _ in range(64)))
    programs, address = {}, 64
    for name, lines in PROGRAMS.items():
        words = [*assemble(lines).tolist(), *[0] * 4]
        rows = [words[k : k + 4][::-1] for k in range(0, len(lines), 4)]
        if rows:
            await load(dut, address, "".join("".join(f"{w:08x}" for w in r) + "\n" for r in rows))
        programs[name] = address, len(lines)
        address += len(rows)

    for _ in range(2):
        for name, (program, length) in programs.items():
            cycles = await cycles_of(dut, program, length)
            bits = dut.counters.value.to_unsigned()
            found = COUNTERS.from_bits(bits).cycles
            counters = {field: found[field] for field, _ in CYCLES}
            assert sum(counters.values()) == cycles, f"{name}: {counters} in {cycles} cycles"
            assert counters["instructions"] == length, name
    assert not dut.outside.value


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_job_waits_for_the_one_before(dut):
    await start(dut, load=0, dump=0, i__valid=0, latency=9, stall=0, seed=1)
    await load(dut, 0, "".join(f"{random.getrandbits(128):032x}\n" for _ in range(65)))
    await load(dut, 64, f"{0:032x}\n")  # four times LOAD v0, 0
    offer = job(TINY).const({"program": {"address": 64, "length": 4}, "vertices": 0, "nodes": 0})
    source = cocotb.start_soon(put(dut, "i", [offer.as_bits()] * 3))
    busy = []
    while not source.done() or dut.busy.value:
        await RisingEdge(dut.clk)
        busy.append(int(dut.busy.value))
    gaps = "".join(map(str, busy)).strip("0").split("0")
    assert [len(run) for run in gaps] == [len(gaps[0])] * 3, "one cycle between jobs, each alike"


def test_counters(tmp_path, seed):
    bench = Bench(UpdateProcessor(TINY), WORDS)
    run_cocotb(bench, __name__, tmp_path, seed=seed, sources=[MEMORY_MODEL])
