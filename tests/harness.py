"""Runs a component as Verilog under cocotb, drives its streams and stands in for its memory.

`SIM=icarus` chooses the simulator. `WAVES=1` keeps the waves, in FST files in the folder `waves`.
"""

import os
import random
import shutil
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from amaranth import Module
from amaranth.lib import data, wiring
from amaranth.lib.wiring import Out
from cocotb.clock import Clock
from cocotb.simtime import get_sim_time
from cocotb.triggers import RisingEdge

from hdl.config import FULL, TINY, Config
from hdl.fp.format import FloatFormat
from hdl.memory.port import request
from sim.cosim import verilate
from sim.model.fp.format import decode
from sim.model.fp.order import order_key

CYCLE = 10  # ns

CONFIGS = {
    "smallest": Config(FloatFormat(2, 1), 3, 2, latency=1, address_bits=4),
    "tiny": TINY,
    "odd": Config(FloatFormat(4, 8), 11, 7, latency=9, address_bits=13),  # half a byte unused
    "full": FULL,
    "wide": Config(FloatFormat(8, 23), 16, 9, latency=20, address_bits=14),  # 256-bit words
}


def waves_file(name: str) -> Path:
    """Where the waves of a test go."""
    Path("waves").mkdir(exist_ok=True)
    return Path("waves", f"{name}.fst").resolve()


def run_cocotb(component, test_module: str, work: Path, *, seed: int, sources=(), **env):
    """Run the cocotb tests of `test_module` on the Verilog of a component.

    Parameters
    ----------
    component : Component
    test_module : str
    work : Path
        Empty folder, for logs.
    seed : int
        Of `random` and `cocotb.RANDOM_SEED` in the tests.
    sources : sequence of Path
        Verilog files that the component instances.
    env
        What the tests find in os.environ.
    """
    folder = verilate.build(component, sources=sources, waves=verilate.WAVES_WANTED)
    try:
        verilate.run(
            folder, test_module, work, waves=verilate.WAVES_WANTED, COCOTB_RANDOM_SEED=seed, **env
        )
    finally:
        if verilate.WAVES_WANTED:
            test = os.environ.get("PYTEST_CURRENT_TEST", test_module).split("::")[-1]
            kept = waves_file(f"{test_module}.{test.split(' ')[0]}")
            shutil.move(work / verilate.WAVES, kept)
            print(f"waves: {kept}")


class SideBySide(wiring.Component):
    """Components in one Verilog, so that one build serves all: port `i` of `tiny` is `tiny__i`.

    A stream that is always ready has no ready there: a constant cannot be a port.
    """

    def __init__(self, components: dict[str, wiring.Component]):
        self.components = components
        super().__init__({
            name: Out(
                wiring.Signature({
                    port: _without_constants(member)
                    for port, member in part.signature.members.items()
                })
            )
            for name, part in components.items()
        })

    def elaborate(self, platform):
        m = Module()
        for name, part in self.components.items():
            m.submodules[name] = part
            for port, member in part.signature.members.items():
                outer, inner = getattr(getattr(self, name), port), getattr(part, port)
                # flipped() takes no arrays
                pairs = zip(outer, inner, strict=True) if member.dimensions else [(outer, inner)]
                for one, other in pairs:
                    _join(m, member, one, other)
        return m


def _always_ready(member: wiring.Member) -> bool:
    return member.is_signature and getattr(member.signature, "always_ready", False)


def _without_constants(member: wiring.Member) -> wiring.Member:
    """A member of a signature, but that of a stream that is always ready has no ready."""
    if not _always_ready(member):
        return member
    payload = member.signature.members["payload"].shape
    return wiring.Member(member.flow, wiring.Signature({"valid": Out(1), "payload": Out(payload)}))


def _join(m: Module, member: wiring.Member, outer, inner):
    """Make a port of a part one of the whole."""
    if member.is_signature and not _always_ready(member):
        wiring.connect(m, wiring.flipped(outer), inner)
        return
    parts = ("valid", "payload") if member.is_signature else (None,)
    for part in parts:
        a, b = (getattr(x, part) if part else x for x in (outer, inner))
        m.d.comb += a.eq(b) if member.flow == Out else b.eq(a)


def unbuilt(component: wiring.Component):
    """A component that is asked for its shapes only: Amaranth warns of one that is not built."""
    component._MustUse__silence = True
    return component


# Payloads


def leaves(layout: data.Layout, fmt: FloatFormat, prefix: str = "", offset: int = 0):
    """Name, offset and width of each number in a layout; floats are whole. `v0.x` is x in v0."""
    for name, field in layout:
        at = offset + field.offset
        if isinstance(field.shape, data.Layout) and field.shape != fmt.layout:
            yield from leaves(field.shape, fmt, f"{prefix}{name}.", at)
        else:
            yield f"{prefix}{name}", at, field.width


def pack(layout: data.Layout, fmt: FloatFormat, columns: dict) -> list[int]:
    """Payloads of a layout from a column of numbers for each of its leaves."""
    places = list(leaves(layout, fmt))
    assert {name for name, _, _ in places} == set(columns)
    rows = [0] * len(next(iter(columns.values())))
    for name, offset, width in places:
        for row, value in enumerate(map(int, columns[name])):
            assert 0 <= value < 1 << width, f"{name} = {value} does not fit {width} bits"
            rows[row] |= value << offset
    return rows


def unpack(layout: data.Layout, bits: int) -> dict[str, int]:
    """The fields of a payload, each as a number."""
    return {name: bits >> f.offset & (1 << f.width) - 1 for name, f in layout}


def difference(fmt: FloatFormat, layout: data.Layout, got: int, want: int) -> str:
    """The first number in which payloads differ: raw bits, and of a float ulps and values."""
    for name, offset, width in leaves(layout, fmt):
        a, b = (bits >> offset & (1 << width) - 1 for bits in (got, want))
        if a != b:
            return (
                f"{name}: {float_difference(fmt, a, b)}"
                if width == fmt.bits
                else (f"{name}: {a:x}, not {b:x}")
            )
    return f"{got:x}, not {want:x}"


def float_difference(fmt: FloatFormat, got: int, want: int) -> str:
    """Two bit patterns, the ulps between them, and their values."""
    digits = -(-fmt.bits // 4)
    ulps = int(order_key(fmt, got) - order_key(fmt, want))
    return (
        f"{got:0{digits}x}, not {want:0{digits}x}: {ulps:+} ulp, "
        f"{decode(fmt, got):.9g}, not {decode(fmt, want):.9g}"
    )


# Clock and streams


def now() -> int:
    """Cycles since the clock began."""
    return int(get_sim_time("ns")) // CYCLE


async def start(dut, **inputs: int):
    """Start the clock, set inputs, and leave reset."""
    for name, value in inputs.items():
        getattr(dut, name).value = value
    dut.rst.value = 1
    Clock(dut.clk, CYCLE, unit="ns", impl="gpi").start()
    for _ in range(2):  # one edge is not enough for Icarus under a gpi clock
        await RisingEdge(dut.clk)
    dut.rst.value = 0


async def put(dut, name: str, payloads, idle: float = 0.0):
    """Send payloads into a stream, with gaps in a part `idle` of the cycles; never waits to offer.

    Ends at the edge at which the last one is taken.
    """
    valid, payload = getattr(dut, f"{name}__valid"), getattr(dut, f"{name}__payload")
    ready = getattr(dut, f"{name}__ready")
    for word in payloads:
        while random.random() < idle:
            valid.value = 0
            await RisingEdge(dut.clk)
        valid.value = 1
        payload.value = word
        await RisingEdge(dut.clk)
        while not ready.value:
            await RisingEdge(dut.clk)
    valid.value = 0


async def take(
    dut, name: str, count: int, busy: float = 0.0, cycles: list | None = None
) -> list[int]:
    """The next `count` payloads of a stream; the stream's rules are checked.

    A busy taker is ready only after it has seen valid, and then in a part 1 - `busy` of the
    cycles; what waits has to stay as it is. `cycles` gets the cycle of each payload.
    """
    valid, payload = getattr(dut, f"{name}__valid"), getattr(dut, f"{name}__payload")
    ready = getattr(dut, f"{name}__ready")
    words: list[int] = []
    willing = not busy
    waiting = None
    while len(words) < count:
        ready.value = willing
        await RisingEdge(dut.clk)
        if not valid.value:
            assert waiting is None, f"{name}: valid was withdrawn"
            willing = not busy
            continue
        word = payload.value.to_unsigned()
        assert waiting in (None, word), f"{name}: payload {waiting:x} became {word:x} as it waited"
        waiting = None if willing else word
        if willing:
            words.append(word)
            if cycles is not None:
                cycles.append(now())
        willing = random.random() >= busy
    ready.value = 0
    return words


# Memory


@dataclass(frozen=True)
class Request:
    """A request that a memory took, and when."""

    cycle: int
    address: int
    write: int
    mask: int
    data: int


class Memory:
    """Stands in for the memory at a port, and checks the port's rules.

    Parameters
    ----------
    dut
    port : str
    config : Config
    words : dict of address to word
        Changes with each write; a read of a word that is not there fails.
    latency : int
        Cycles from request to response, at least 1.
    busy : float
        Chance that a cycle takes no request or begins no response. A busy memory is ready only
        after it has seen valid.
    period : int
        Requests are taken in one of so many cycles only.

    Attributes
    ----------
    requests : list of Request
    responses : list of cycles
    most_under_way : int
        Reads that waited for their response together.
    """

    def __init__(
        self, dut, port: str, config: Config, words: dict[int, int],
        *, latency: int = 1, busy: float = 0.0, period: int = 1,
    ):  # fmt: skip
        self.dut, self.port, self.words = dut, port, words
        self.latency, self.busy, self.period = latency, busy, period
        self.layout = request(config)
        self.requests: list[Request] = []
        self.responses: list[int] = []
        self.most_under_way = 0

    async def run(self):
        """Serve without end."""
        dut, port, layout = self.dut, self.port, self.layout
        valid, payload, ready = (
            getattr(dut, f"{port}__request__{name}") for name in ("valid", "payload", "ready")
        )
        # An output that is constant or an input that nobody reads may not be in the Verilog.
        answer_valid, answer, answer_ready = (
            getattr(dut, f"{port}__response__{name}", None)
            for name in ("valid", "payload", "ready")
        )
        due: deque[tuple[int, int]] = deque()
        waiting = None
        willing = not self.busy
        answering = False
        while True:
            ready.value = willing = willing and now() % self.period == 0
            if not answering and due and due[0][0] <= now() and random.random() >= self.busy:
                answering = True
                answer_valid.value = 1
                answer.value = due[0][1]
            elif not answering and answer_valid is not None:
                answer_valid.value = 0
            await RisingEdge(dut.clk)
            if answering and (answer_ready is None or answer_ready.value):
                answering = False
                due.popleft()
                self.responses.append(now())
            if not valid.value:
                assert waiting is None, f"{port}: a request was withdrawn"
                willing = not self.busy
                continue
            bits = payload.value.to_unsigned()
            assert waiting in (None, bits), f"{port}: request {waiting:x} became {bits:x}"
            waiting = None if willing else bits
            if willing:
                taken = Request(now(), **unpack(layout, bits))
                self.requests.append(taken)
                if taken.write:
                    self.words[taken.address] = written(self.words.get(taken.address, 0), taken)
                else:
                    assert taken.address in self.words, f"{port}: read of word {taken.address}"
                    due.append((now() + self.latency - 1, self.words[taken.address]))
                    self.most_under_way = max(self.most_under_way, len(due))
            willing = random.random() >= self.busy


def written(word: int, request) -> int:
    """A word after a write of the bytes of a request's mask."""
    bits = sum(0xFF << 8 * k for k in range(request.mask.bit_length()) if request.mask >> k & 1)
    return word & ~bits | request.data & bits
