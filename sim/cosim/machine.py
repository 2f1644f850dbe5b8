"""The simulated machine, as a Python object that reads, writes and runs jobs."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from amaranth.lib import data

from hdl.config import Config
from hdl.core import Core
from hdl.records import word_bits
from hdl.update.processor import UpdateProcessor
from sim.cosim import verilate
from sim.cosim.bench import MEMORY_MODEL, Bench
from sim.cosim.process import Process

SLICE = 20_000
"""Cycles between two looks at a job that runs."""


@dataclass(frozen=True)
class Timing:
    """How the memory behaves.

    Attributes
    ----------
    latency : int
        Cycles from a request to its response, 1 to 1000.
    stalls : float
        Chance that a cycle takes no request, and that a response comes a cycle later; below 1.
    seed : int
        Of the stalls, 1 to 2**32 - 1.
    """

    latency: int = 32
    stalls: float = 0.0
    seed: int = 1

    def __post_init__(self):
        if not 1 <= self.latency <= 1000:
            raise ValueError(f"the memory model's latency is 1 to 1000 cycles, not {self.latency}")
        if not 0 <= self.stalls <= 0.9:
            raise ValueError(f"the share of stalls is 0 to 0.9, not {self.stalls}")
        if not 1 <= self.seed < 1 << 32:
            raise ValueError(f"the seed of stalls is 1 to 2**32 - 1, not {self.seed}")


class Machine:
    """The Verilog of a unit and a memory, simulated in a process of its own.

    A context manager: the simulator ends with it. Words are rows of uint32, the lowest first.

    Parameters
    ----------
    config : Config
    words : int
        Least size of the memory; the real one is a power of 16 from a million on, or all that the
        configuration addresses, so that few simulators are built.
    timing : Timing
    waves : Path, optional
        FST file for the waves of the whole run.
    unit : class
        What runs jobs: the update processor alone, or the core.

    Attributes
    ----------
    overflow : bool
        A vertex of the last update was infinite.

    Raises
    ------
    SimulationError
        The simulator does not build or start, or a job does not end.
    """

    def __init__(
        self,
        config: Config,
        words: int,
        timing: Timing,
        waves: Path | None = None,
        unit: type[UpdateProcessor] | type[Core] = UpdateProcessor,
    ):
        size = 1 << -(-max(words.bit_length(), 20) // 4) * 4
        bench = Bench(unit(config), min(size, 1 << config.address_bits))
        self.config = config
        self._job, self._counters = bench.i.payload.shape(), bench.counters.shape()
        self.timing = timing
        folder = verilate.build(
            bench,
            sources=[MEMORY_MODEL],
            waves=waves is not None,
            identity=f"{unit.__module__} {unit.__qualname__} {config} {bench.words}",
        )
        self._process = Process(folder, "sim.cosim.server", waves)
        self._call = self._process.call
        self.overflow = False
        self.reset(timing)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.close()

    def reset(self, timing: Timing):
        """Reset the machine, not the words in its memory, and let the memory behave so."""
        self._call("reset", timing.latency, int(timing.stalls * 65536), timing.seed)
        self.timing = timing

    def write(self, address: int, words: np.ndarray):
        """Write words (n, limbs) from an address on."""
        if len(words):
            digits = np.ascontiguousarray(words[:, ::-1]).astype(">u4").tobytes().hex()
            width = word_bits(self.config.fmt) // 4
            lines = (digits[k : k + width] for k in range(0, len(digits), width))
            self._call("load", address, "\n".join(lines) + "\n")

    def change(self, held: np.ndarray | None, words: np.ndarray) -> int:
        """Write those of words (n, limbs) from address 0 on that are not `held`; how many.

        All of them where nothing is known of the memory.
        """
        changed = np.ones(len(words), np.bool_) if held is None else (words != held).any(axis=1)
        for begin, end in _runs(changed):
            self.write(begin, words[begin:end])
        return int(changed.sum())

    def read(self, address: int, count: int) -> np.ndarray:
        """Words (count, limbs) from an address on."""
        limbs = word_bits(self.config.fmt) // 32
        if not count:
            return np.zeros((0, limbs), np.uint32)
        digits = self._call("dump", address, count)
        words = np.frombuffer(bytes.fromhex(digits), ">u4").reshape(count, limbs)
        return words[:, ::-1].astype(np.uint32)

    def update(
        self,
        program: int,
        length: int,
        vertices: int,
        nodes: int,
        *,
        most_cycles: int | None = None,
    ) -> dict[str, int]:
        """Run a program of `length` instructions; addresses in words. Its cycles, by kind.

        For a machine of the update processor alone. Sets `overflow`.

        Raises
        ------
        SimulationError
            It uses an address outside of the memory, or does not end within `most_cycles`: if
            not given, many times of what the slowest program takes on this memory.
        """
        job = {
            "program": {"address": program, "length": length},
            "vertices": vertices,
            "nodes": nodes,
        }
        counters = self.run(job, most_cycles or self.slowest_update(length))
        self.overflow = bool(counters["overflow"])
        return counters["cycles"]

    def slowest_update(self, length: int) -> int:
        """Many times of the cycles that the slowest program of a length takes."""
        worst = 8 * (self.timing.latency + 40) / (1 - self.timing.stalls) ** 2
        return 10_000 + int(length * worst)

    def run(
        self,
        job: dict,
        most_cycles: int,
        tick: Callable[[dict], None] = lambda _: None,
    ) -> dict:
        """Run a job, given by the fields of its layout. The unit's counters, likewise.

        Now and then `tick` is told what they are by then.

        Raises
        ------
        SimulationError
            It uses an address outside of the memory, or does not end within `most_cycles`.
        """
        given = most_cycles
        self._call("start", self._job.const(job).as_bits())
        while True:
            cycles = min(SLICE, most_cycles)
            most_cycles -= cycles
            ended, bits = self._call("wait", cycles)
            counters = _figures(self._counters.from_bits(bits))
            if ended:
                return counters
            if not most_cycles:
                self.reset(self.timing)
                raise verilate.SimulationError(f"the job did not end within {given} cycles")
            tick(counters)


def _figures(view: data.Const) -> dict:
    """Numbers by their names, in dictionaries where layouts hold layouts."""
    fields = ((name, view[name]) for name, _ in view.shape())
    return {k: v if isinstance(v, int) else _figures(v) for k, v in fields}


def _runs(wanted: np.ndarray) -> list[tuple[int, int]]:
    """Where runs of neighbours begin and end of which all are wanted (n,)."""
    edges = np.flatnonzero(np.diff(wanted, prepend=False, append=False))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))
