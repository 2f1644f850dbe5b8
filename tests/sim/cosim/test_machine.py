"""The simulated machine: memory, timing, waves and failures."""

from dataclasses import replace

import numpy as np
import pylibfst
import pytest

from hdl.config import TINY
from sim.compiler.disassemble import assemble
from sim.cosim.machine import Machine, Timing
from sim.cosim.verilate import SimulationError

NODES_AT = 200


def random_words(rng, count):
    return rng.integers(0, 2**32, (count, 4), dtype=np.uint32)


@pytest.mark.parametrize("latency", [1, 2, 1000])
@pytest.mark.parametrize("stalls", [0.0, 0.5])
def test_words_come_back(latency, stalls, rng):
    with Machine(TINY, 300, Timing(latency, stalls)) as machine:
        words = random_words(rng, 300)
        machine.write(0, words)
        machine.write(17, words[:0])
        assert (machine.read(0, 300) == words).all()
        machine.write(100, words[:3])
        assert (machine.read(99, 5) == words[[99, 0, 1, 2, 103]]).all()
        assert machine.read(5, 0).shape == (0, 4)


def test_latency_is_what_was_asked_for():
    """One load and its merge wait for the memory, and for nothing else that depends on it."""
    program = assemble(["LOAD v0, 0", "MERGE3 b0, v0, v0, v0"])
    waits = {}
    with Machine(TINY, 300, Timing()) as machine:
        machine.write(0, np.pad(program, (0, 2)).reshape(1, 4))
        machine.write(100, np.zeros((1, 4), np.uint32))
        for latency in (1, 4, 33, 1000):
            machine.reset(Timing(latency))
            counters = machine.update(0, len(program), 100, NODES_AT)
            waits[latency] = counters["vertex"]
            assert counters["instructions"] == 2
    units = TINY.load_latency - TINY.latency - 1
    assert waits == {latency: latency + units for latency in waits}


def test_stalls_cost_what_their_share_says(rng):
    program = assemble(["LOAD v0, 0"] * 64)
    with Machine(TINY, 300, Timing()) as machine:
        machine.write(0, program.reshape(-1, 4))
        machine.write(100, random_words(rng, 1))
        machine.reset(Timing(4, 0.5, seed=1))
        first = machine.update(0, 64, 100, NODES_AT)
        machine.reset(Timing(4, 0.5, seed=1))
        assert machine.update(0, 64, 100, NODES_AT) == first, "a seed gives the same stalls"
        machine.reset(Timing(4, 0.5, seed=2))
        assert machine.update(0, 64, 100, NODES_AT) != first


def test_an_address_outside_of_the_memory_is_an_error():
    program = assemble(["LOAD v0, 5000000"])
    with Machine(replace(TINY, address_bits=24), 300, Timing()) as machine:
        machine.write(0, np.pad(program, (0, 3)).reshape(1, 4))
        with pytest.raises(SimulationError, match="outside of the memory"):
            machine.update(0, 1, 0, NODES_AT)


def test_an_update_that_does_not_end_is_an_error():
    program = assemble(["LOAD v0, 0"] * 400)
    with Machine(TINY, 300, Timing()) as machine:
        machine.write(0, program.reshape(-1, 4))
        with pytest.raises(SimulationError, match="did not end within 100 cycles"):
            machine.update(0, len(program), 100, NODES_AT, most_cycles=100)


def test_a_simulator_that_dies_is_an_error():
    with Machine(TINY, 300, Timing()) as machine, pytest.raises(SimulationError, match="Key"):
        machine._call("no such call")


@pytest.mark.parametrize(
    "values", [{"latency": 0}, {"latency": 1001}, {"stalls": -0.1}, {"stalls": 1.0}, {"seed": 0}]
)
def test_timing_refuses(values):
    with pytest.raises(ValueError, match="is .* to .*, not"):
        Timing(**values)


def test_waves_hold_the_run(tmp_path):
    file = tmp_path / "run.fst"
    program = assemble(["LOAD v0, 0", "MERGE3 b0, v0, v0, v0", "MERGE2 b0, b0, b0, x"])
    with Machine(TINY, 300, Timing(7), file) as machine:
        machine.write(0, np.pad(program, (0, 1)).reshape(1, 4))
        machine.write(100, np.zeros((1, 4), np.uint32))
        machine.write(NODES_AT, np.zeros((1, 4), np.uint32))
        cycles = sum(machine.update(0, len(program), 100, NODES_AT).values())
    waves = pylibfst.lib.fstReaderOpen(str(file).encode())
    _, signals = pylibfst.get_scopes_signals2(waves)
    busy = signals.by_name["dut.unit.busy"].handle
    text = pylibfst.ffi.new("char[64]")

    def value(time):
        return pylibfst.string(
            pylibfst.lib.fstReaderGetValueFromHandleAtTime(waves, time, busy, text)
        )

    end = pylibfst.lib.fstReaderGetEndTime(waves)
    picoseconds = sum(1 for time in range(5000, end, 10000) if value(time) == "1") * 10000
    pylibfst.lib.fstReaderClose(waves)
    assert picoseconds == cycles * 10000
