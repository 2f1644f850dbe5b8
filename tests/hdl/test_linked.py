"""hdl.linked, as Verilog: jobs of a host by bytes, on a memory that takes its time."""

import os
import random
import struct
from dataclasses import replace
from pathlib import Path

import cocotb
import numpy as np
import pytest
from cocotb.triggers import RisingEdge

from hdl.config import TINY
from hdl.identification import Surroundings
from hdl.link.protocol import BODY_BYTES, VERSION, Kind
from hdl.linked import LinkedCore
from hdl.records import word_bits
from hdl.registers import CONTROL, STATUS, Outcome, registers
from sim.cosim.verilate import simulator
from sim.prepare import prepare
from sim.scene.load import load_scene
from tests.fpga import jobs
from tests.harness import SideBySide, run_cocotb
from tests.hdl.checked import random_rays, random_view
from tests.hdl.link.host import decode, encode
from tests.hdl.link.reference import Frame
from tests.memory import Memory
from tests.streams import start, take

CLOCK_HZ = 50_000_000
BYTES = word_bits(TINY.fmt) // 8
REGISTERS = {register.name: register.offset // 4 for register in registers(TINY)}
START, STOP = (CONTROL.const({name: 1}).as_bits() for name in ("start", "stop"))


class Host:
    """A machine, its memory, and a host that asks one thing after the other.

    Attributes
    ----------
    memory : Memory
    """

    def __init__(self, dut, memory: Memory):
        self.dut, self.memory = dut, memory
        self.session, self.sequence = random.randrange(1, 1 << 16), 0
        self.executed = 0

    @classmethod
    async def begin(cls, dut, size: int, **timing) -> "Host":
        inputs = ("unsettled", "read_failed", "write_failed", "framing_error", "i__valid")
        inputs += ("o__ready", "port__response__valid")
        await start(dut, **{f"linked__{name}": 0 for name in inputs})
        memory = Memory(dut, "linked__port", TINY, dict.fromkeys(range(size), 0), **timing)
        cocotb.start_soon(memory.run())
        host = cls(dut, memory)
        await host.ask(Kind.HELLO, bytes([VERSION]))
        return host

    async def ask(self, kind: Kind, body: bytes) -> bytes:
        """The answer to a command that is right."""
        valid, payload = self.dut.linked__i__valid, self.dut.linked__i__payload
        for byte in encode(Frame(kind.value, self.session, self.sequence, body)):
            valid.value, payload.value = 1, byte
            await RisingEdge(self.dut.clk)
        valid.value = 0
        self.sequence += 1
        self.executed += 1
        line = bytearray()
        while byte := (await take(self.dut, "linked__o", 1))[0]:
            line.append(byte)
        answer = decode(bytes(line))
        assert answer.kind == Kind.OK.value, answer
        return answer.body

    async def peek(self, name: str) -> int:
        said = await self.ask(Kind.PEEK, struct.pack("<HH", REGISTERS[name], 1))
        return int.from_bytes(said, "little")

    async def poke(self, name: str, *values: int):
        body = struct.pack(f"<H{len(values)}I", REGISTERS[name], *values)
        await self.ask(Kind.POKE, body)

    async def status(self) -> tuple[int, int, Outcome]:
        view = STATUS.from_bits(await self.peek("STATUS"))
        return view.busy, view.done, view.outcome

    async def read(self, count: int) -> bytes:
        """The words from 0 on."""
        most, found = BODY_BYTES // BYTES, b""
        for first in range(0, count, most):
            words = min(most, count - first)
            found += await self.ask(Kind.READ, struct.pack("<IHBB", first, words, 0, BYTES))
        return found

    async def write(self, image: bytes):
        """Words from 0 on."""
        step = (BODY_BYTES - 8) // BYTES * BYTES
        for first in range(0, len(image), step):
            part = image[first : first + step]
            run = struct.pack("<BBIH", 0, BYTES, first // BYTES, len(part) // BYTES)
            await self.ask(Kind.WRITE, run + part)

    def place(self, image: bytes):
        """Words from 0 on, not by the line."""
        for k in range(0, len(image), BYTES):
            self.memory.words[k // BYTES] = int.from_bytes(image[k : k + BYTES], "little")

    def found(self) -> bytes:
        words = (self.memory.words[k] for k in range(len(self.memory.words)))
        return b"".join(word.to_bytes(BYTES, "little") for word in words)

    async def start(self, run: jobs.Run):
        await self.poke(next(iter(run.job)), *run.job.values())
        await self.poke("CONTROL", START)

    async def end(self) -> Outcome:
        while True:
            busy, done, outcome = await self.status()
            if not busy:
                assert done
                return outcome

    async def run(self, run: jobs.Run):
        """A run whose memory and counters have to be the model's."""
        self.place(run.before)
        await self.start(run)
        assert await self.end() == Outcome.COMPLETE
        assert self.found() == run.after, run.name
        for name, value in run.counters.items():
            assert await self.peek(name) == value, f"{run.name}: {name}"


def given() -> tuple[int, list[jobs.Run]]:
    size, runs, _ = jobs.read(Path(os.environ["JOBS"]))
    return size // BYTES, runs


@cocotb.test(timeout_time=30, timeout_unit="ms")
@cocotb.parametrize((("latency", "busy"), [(1, 0.0), (7, 0.4)]))
async def memory_and_counters_are_those_of_the_model(dut, latency, busy):
    size, runs = given()
    host = await Host.begin(dut, size, latency=latency, busy=busy)
    for run in runs:
        await host.run(run)


@cocotb.test(timeout_time=30, timeout_unit="ms")
async def all_goes_by_the_line(dut):
    size, (update, _, _) = given()
    host = await Host.begin(dut, size, latency=3)
    await host.write(update.before)
    await host.start(update)
    assert await host.end() == Outcome.COMPLETE
    assert await host.read(size) == update.after


@cocotb.test(timeout_time=30, timeout_unit="ms")
async def it_says_what_it_is_and_counts(dut):
    size, _ = given()
    host = await Host.begin(dut, size)
    assert await host.peek("MEMORY_WORDS") == size and await host.peek("CLOCK_HZ") == CLOCK_HZ
    assert await host.peek("LINK_EXECUTED") == host.executed - 1
    dut.linked__framing_error.value = 1
    for _ in range(3):
        await RisingEdge(dut.clk)
    dut.linked__framing_error.value = 0
    assert await host.peek("LINK_FRAMING_ERRORS") == 3
    assert await host.peek("LINK_DAMAGED") == 0


@cocotb.test(timeout_time=30, timeout_unit="ms")
async def the_line_is_served_during_a_run(dut):
    size, (_, frame, _) = given()
    host = await Host.begin(dut, size, latency=5)
    host.place(frame.before)
    await host.start(frame)
    count, before = 8, frame.before[: 8 * BYTES]
    reads = 0
    while (await host.status())[0]:
        assert await host.read(count) == before  # the program: it does not change
        reads += 1
    assert reads > 1 and host.found() == frame.after


@cocotb.test(timeout_time=60, timeout_unit="ms")
@cocotb.parametrize(latency=[1, 20])
async def a_run_can_be_stopped_anywhere(dut, latency):
    size, runs = given()
    host = await Host.begin(dut, size, latency=latency, busy=0.2)
    for run in runs:
        for _ in range(4):
            host.place(run.before)
            await host.start(run)
            for _ in range(random.randrange(400)):
                await RisingEdge(dut.clk)
            await host.poke("CONTROL", STOP)
            assert await host.end() in (Outcome.STOPPED, Outcome.COMPLETE)
            found = host.found()
            assert await host.read(size) == found  # no answer of the run's comes to the host
        await host.run(run)


@cocotb.test(timeout_time=30, timeout_unit="ms")
@cocotb.parametrize(how=["read", "write"])
async def an_error_of_the_memory_ends_the_run(dut, how):
    size, (update, *_) = given()
    host = await Host.begin(dut, size, latency=9)
    host.place(update.before)
    await host.poke(next(iter(update.job)), *update.job.values())
    fails = getattr(dut, f"linked__{how}_failed")
    starting = cocotb.start_soon(host.poke("CONTROL", START))
    while not dut.linked__busy.value:
        await RisingEdge(dut.clk)
    fails.value = 1
    await RisingEdge(dut.clk)
    fails.value = 0
    await starting
    assert await host.end() == Outcome[f"{how.upper()}_ERROR"]
    await host.run(update)


def test_contract(tmp_path, seed):
    rng = np.random.default_rng(seed)
    prepared = prepare(load_scene("waves:8"), TINY)
    rays, view = random_rays(rng, TINY.fmt, 24), random_view(rng, TINY.fmt, 5, 3)
    size, runs = jobs.frames(prepared, rays, view, (0, 3, 5))
    jobs.write(tmp_path / "jobs", size, runs, TINY)
    unit = LinkedCore(TINY, Surroundings(size // BYTES, CLOCK_HZ), outstanding=16)
    # On Icarus the rest takes minutes.
    quick = {"COCOTB_TEST_FILTER": "all_goes|it_says|an_error"} if simulator() == "icarus" else {}
    jobs_file = tmp_path / "jobs"
    run_cocotb(SideBySide({"linked": unit}), __name__, tmp_path, seed=seed, JOBS=jobs_file, **quick)


@pytest.mark.parametrize("words", [0, 1 + (1 << TINY.address_bits)])
def test_sizes_that_are_none(words):
    with pytest.raises(ValueError, match=f"these are {words}"):
        LinkedCore(TINY, Surroundings(words))


def test_one_port_wants_caches():
    with pytest.raises(ValueError, match="caches"):
        LinkedCore(replace(TINY, cache_words=0), Surroundings(16))
