"""hdl.update.processor: any legal program, at any memory timing, against sim.model.update."""

import os
from collections import Counter
from functools import partial

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st

from hdl import records
from hdl.records import word_bits
from sim.compiler.check import check
from sim.compiler.disassemble import assemble, disassemble
from sim.cosim import verilate
from sim.cosim.machine import Machine, Timing
from sim.model.update import execute
from tests.harness import CONFIGS, waves_file
from tests.hdl.update.programs import (
    Job,
    bounds_of,
    coordinates,
    jobs,
    put_columns,
    write_job,
)
from tests.payloads import float_difference

ICARUS = os.environ.get("SIM") == "icarus"
# Examples of random programs on Verilator and on Icarus, where a cycle takes far longer.
EXAMPLES = {
    "smallest": (60, 25), "tiny": (120, 40), "odd": (60, 15), "full": (60, 12), "wide": (40, 10),
}  # fmt: skip
LONGEST = 60 if ICARUS else 150
WORDS = 4096
BOUNDS = ("left lo", "left hi", "right lo", "right hi")


class Checked:
    """A machine, and beside it the memory that it should have."""

    def __init__(self, name: str, machine: Machine):
        self.name, self.machine = name, machine
        self.config = machine.config
        self.words = min(WORDS, 1 << self.config.address_bits)
        limbs = word_bits(self.config.fmt) // 32
        rng = np.random.default_rng(2006)
        self.memory = rng.integers(0, 1 << 32, (self.words, limbs), np.uint32)
        machine.write(0, self.memory)

    def run(self, job: Job) -> dict[str, int]:
        """Run a job; compare all of memory with what the model says. The counters."""
        config, length = self.config, len(job.instructions)
        check(config, job.instructions, job.vertices, job.nodes, complete=False)
        write_job(config, job, self.memory)
        self._write(job.program_at, -(-length // self.memory.shape[1]))
        self._write(job.vertices_at, job.vertices)
        before = bounds_of(config, self.memory[job.nodes_at :][: job.nodes])
        bounds = execute(config, job.instructions, coordinates(config, job), before)
        self._expect(job, bounds, before)

        timing = self.machine.timing
        # Every memory access alone, and each stalled as never before: else it hangs.
        worst = (timing.latency + 20) / (1 - timing.stalls) ** 2
        counters = self.machine.update(
            job.program_at, length, job.vertices_at, job.nodes_at,
            most_cycles=1000 + int(3 * length * worst),
        )  # fmt: skip
        found = self.machine.read(0, self.words)
        differ = np.flatnonzero((found != self.memory).any(axis=1))
        if len(differ):
            message = self._describe(job, int(differ[0]), found)
            self.memory = found.copy()  # so that the next job does not fail for this one
            raise AssertionError(f"{len(differ)} words differ; {message}")
        assert counters["instructions"] == length
        return counters

    def _write(self, address, count):
        self.machine.write(address, self.memory[address : address + count])

    def _expect(self, job, bounds, before):
        """Note the bounds of the nodes that the job writes; their padding becomes zero."""
        config = self.config
        opcodes = job.instructions & 3
        node, written = 0, []
        for opcode, word in zip(opcodes.tolist(), job.instructions.tolist(), strict=True):
            if opcode == 2:
                written.append(node)
                node += 1
            elif opcode == 3:
                node = word >> 2
        unwritten = np.setdiff1d(np.arange(job.nodes), written)
        assert (bounds[unwritten] == before[unwritten]).all(), "the model wrote a node too many"
        rows = job.nodes_at + np.array(written, np.int64)
        words = self.memory[rows]
        words.view(np.uint8)[:, : records.bound_bytes(config.fmt)] = 0
        put_columns(words, records.bounds(config.fmt), bounds[written])
        self.memory[rows] = words

    def _describe(self, job, address, found) -> str:
        """A word that differs: the number in it, or raw bits."""
        config = self.config
        got, want = found[address], self.memory[address]
        raw = [f"{int.from_bytes(x.astype('<u4').tobytes(), 'little'):x}" for x in (got, want)]
        text = f"word {address}: {raw[0]}, not {raw[1]}"
        if job.nodes_at <= address < job.nodes_at + job.nodes:
            a, b = (bounds_of(config, x[None])[0].tolist() for x in (got, want))
            for name, x, y in zip(BOUNDS, a, b, strict=True):
                if x != y:
                    difference = float_difference(config.fmt, x, y)
                    return f"node {address - job.nodes_at}, {name}: {difference}"
        return text


@pytest.fixture(scope="module", params=CONFIGS)
def checked(request):
    """One simulator for all tests of a configuration."""
    config = CONFIGS[request.param]
    file = waves_file(f"{__name__}.{request.param}") if verilate.WAVES_WANTED else None
    words = min(WORDS, 1 << config.address_bits) - 1
    with Machine(config, words, Timing(), file) as machine:
        yield Checked(request.param, machine)
    if file:
        print(f"waves: {file}")


def timings():
    """Memories: ideal ones, and ones that stall."""
    return st.builds(
        Timing,
        latency=st.integers(1, 70),
        stalls=st.sampled_from([0.0, 0.0, 0.2, 0.7]),
        seed=st.integers(1, 2**32 - 1),
    )


def test_any_legal_program_at_any_memory_timing(checked, seed):
    examples = EXAMPLES[checked.name][ICARUS]
    met = Counter()  # cycles of each cause

    def run(timing, batch):
        hypothesis.note("\n".join(line for job in batch for line in disassemble(job.instructions)))
        checked.machine.reset(timing)
        for job in batch:  # back to back, without a reset
            met.update(checked.run(job))

    batches = st.lists(jobs(checked.config, checked.words, LONGEST), min_size=1, max_size=3)
    run = hypothesis.given(timings(), batches)(run)
    phases = [hypothesis.Phase.generate, hypothesis.Phase.shrink][: 1 if ICARUS else 2]
    run = hypothesis.settings(
        phases=phases,  # a failure is made small where that takes seconds
        max_examples=examples,
        deadline=None,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )(run)
    hypothesis.seed(seed)(run)()
    print(f"{checked.name}: {dict(met)}")
    assert met["fetch"] and met["vertex"] and met["box"], "a cause of stall that no program met"


def place(checked, lines, nodes: int) -> Job:
    """A job of a program as text, at the start of memory."""
    instructions = assemble(lines)
    program = -(-len(instructions) // checked.memory.shape[1])
    return Job(instructions, 3, nodes, 0, program, program + 3, seed=1)


def stalls(counters) -> dict[str, int]:
    """The causes for which a job waited once it began."""
    return {
        cause: cycles
        for cause, cycles in counters.items()
        if cycles and cause not in ("instructions", "fetch", "drain")
    }


def test_load_latency(checked):
    config = checked.config
    checked.machine.reset(Timing(config.latency))
    job = partial(place, checked, nodes=1)
    loads = ["LOAD v0, 0", "LOAD v1, 1", "LOAD v2, 2"]
    merge = "MERGE3 b0, v1, v0, v2"
    assert stalls(checked.run(job([*loads, merge]))) == {"vertex": config.load_latency - 1}
    # A load into a register that is being loaded waits as long.
    again = ["LOAD v0, 0", "LOAD v0, 1"]
    assert stalls(checked.run(job(again))) == {"vertex": config.load_latency - 1}


def test_box_latency(checked):
    config = checked.config
    checked.machine.reset(Timing(config.latency))
    first = ["LOAD v0, 0", "MERGE3 b0, v0, v0, v0", "MERGE3 b1, v0, v0, v0"]
    wait = config.box_latency - 1
    vertex = config.load_latency - 1
    for merges, box in (
        (["MERGE2 b0, b0, b1, x"], wait),
        (["MERGE2 b0, b1, b0, y"], wait),
        (["MERGE2 b0, b0, b0, z"], wait - 1),
        (["NODE 1", "MERGE2 b1, b1, b1, z"], wait - 1),
        (["MERGE2 b0, b0, b1, x", "MERGE2 b1, b0, b1, y", "MERGE2 b0, b1, b1, z"], 3 * wait),
        (["MERGE2 b1, b0, b0, x", "MERGE2 b0, b0, b0, y"], wait - 1),
    ):
        counters = checked.run(place(checked, [*first, *merges], nodes=3))
        causes = {"vertex": vertex, "box": box}
        assert stalls(counters) == {name: n for name, n in causes.items() if n}, merges


@pytest.mark.parametrize("stalls", [0.0, 0.5])
def test_empty_program(checked, stalls):
    checked.machine.reset(Timing(5, stalls))
    for _ in range(2):
        counters = checked.run(place(checked, [], nodes=0))
        assert {k: n for k, n in counters.items() if n} == {"fetch": 1, "drain": 1}


def test_loads_wait_for_the_port(checked):
    """Loads come to a memory that stalls faster than it takes them."""
    registers = checked.config.vertex_registers
    if registers < 12:
        pytest.skip("as many loads wait for the port as there are registers")
    checked.machine.reset(Timing(checked.config.latency, 0.8))
    counters = checked.run(place(checked, [f"LOAD v{k}, 1" for k in range(registers)], nodes=0))
    assert counters["load"]


def test_nodes_wait_for_the_port(checked):
    """Nodes come to a memory that stalls faster than it takes them."""
    if checked.words < 100:
        pytest.skip("the program does not fit the memory")
    checked.machine.reset(Timing(checked.config.latency, 0.7))
    first = ["LOAD v0, 0", "MERGE3 b0, v0, v0, v0", "LOAD v1, 1", "MERGE3 b1, v1, v0, v1"]
    counters = checked.run(place(checked, [*first, *["MERGE2 b1, b0, b0, x"] * 60], nodes=60))
    assert counters["write"] > 20


def test_one_instruction_a_cycle(checked):
    """At the latency of the configuration, fetching costs no more than its first word."""
    config = checked.config
    checked.machine.reset(Timing(config.latency))
    most = (checked.words - 4) * checked.memory.shape[1]
    short, long = (
        checked.run(place(checked, ["NODE 0"] * length, nodes=1))
        for length in (1, min(most, 20 * config.latency))
    )
    assert long["fetch"] == short["fetch"]
    assert long["drain"] == short["drain"]
    assert not stalls(long)
