"""hdl.update.issue, as Verilog: each interlock, each cause of a stall, and the count of nodes."""

import os
import random
from collections import Counter, deque

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.isa import LAYOUTS, NODE_BITS, VERTEX_BITS, Opcode
from hdl.update.issue import MERGE3, Issue, Stall, merge2
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.payloads import unpack
from tests.streams import now, start

NAMES = ("smallest", "tiny", "full")
LOAD = ("v", "vertex")
NEVER = 1 << 40


def instruction(opcode: Opcode, **operands: int) -> int:
    """An instruction; bits above its last field are set, since they mean nothing."""
    layout = LAYOUTS[opcode]
    for name, value in operands.items():
        assert 0 <= value < 1 << layout[name].width
    word = layout.const({"opcode": opcode} | operands).as_bits()
    return word | random.getrandbits(32) >> layout.size << layout.size


class Scoreboard:
    """What an Issue may do in a cycle: from the cycles in which registers can be read."""

    def __init__(self, config):
        self.vertex_ready = [0] * config.vertex_registers  # cycle; NEVER: is being loaded
        self.box_ready = [0] * config.box_registers
        self.latency = config.box_latency
        self.node = 0

    def stall(self, cycle: int, word: int, room: bool, load_ready: bool) -> Stall:
        opcode = Opcode(word & 3)
        f = unpack(LAYOUTS[opcode], word)
        match opcode:
            case Opcode.LOAD if self.vertex_ready[f["v"]] > cycle:
                return Stall.VERTEX
            case Opcode.LOAD if not load_ready:
                return Stall.LOAD
            case Opcode.MERGE3 if max(self.vertex_ready[f[v]] for v in ("v0", "v1", "v2")) > cycle:
                return Stall.VERTEX
            case Opcode.MERGE2 if max(self.box_ready[f[b]] for b in ("b0", "b1")) > cycle:
                return Stall.BOX
            case Opcode.MERGE2 if not room:
                return Stall.WRITE
        return Stall.NONE

    def go(self, cycle: int, word: int):
        opcode = Opcode(word & 3)
        f = unpack(LAYOUTS[opcode], word)
        match opcode:
            case Opcode.LOAD:
                self.vertex_ready[f["v"]] = NEVER
            case Opcode.MERGE3:
                self.box_ready[f["b"]] = cycle + self.latency
            case Opcode.MERGE2:
                self.box_ready[f["b"]] = cycle + self.latency
                self.node = (self.node + 1) % (1 << NODE_BITS)
            case Opcode.NODE:
                self.node = f["node"]


class Bench:
    """An Issue, driven and checked cycle by cycle."""

    def __init__(self, dut):
        self.dut, self.name = dut, os.environ["CONFIG"]
        self.config = CONFIGS[self.name]
        self.board = Scoreboard(self.config)
        self.seen: Counter = Counter()  # cycles of each stall
        self.loading: deque[int] = deque()
        self.here = None  # the instruction that goes or waits

    def port(self, name):
        return getattr(self.dut, f"{self.name}__{name}")

    async def begin(self):
        names = ("start", "room", "i__valid", "o_load__ready", "loaded__valid")
        await start(self.dut, **{f"{self.name}__{port}": 0 for port in names})

    async def cycle(self, coming=None, *, room=True, load_ready=True, loaded=False, new=False):
        """One cycle, in which `coming` is offered. Whether it was taken; all outputs are checked.

        What was taken is here in the next cycle: goes, or waits.
        """
        word = self.here
        self.port("i__valid").value = coming is not None
        if coming is not None:
            self.port("i__payload").value = coming
        self.port("room").value = room
        self.port("o_load__ready").value = load_ready
        self.port("loaded__valid").value = loaded
        self.port("start").value = new
        if loaded:
            register = self.loading.popleft()
            self.port("loaded__payload").value = register
        await RisingEdge(self.dut.clk)

        stall = Stall.FETCH
        if word is not None:
            stall = self.board.stall(now(), word, room, load_ready)
        goes = stall is Stall.NONE
        self.seen[stall] += 1
        found = Stall(self.port("stall").value.to_unsigned())
        assert found is stall, f"{found}, not {stall}"
        opcode = None if word is None else Opcode(word & 3)
        steps = goes or word is None
        assert bool(self.port("i__ready").value) == steps
        assert bool(self.port("idle").value) == (word is None)
        # A load is offered until it is taken.
        load = opcode is Opcode.LOAD and stall in (Stall.NONE, Stall.LOAD)
        assert bool(self.port("o_load__valid").value) == load
        assert bool(self.port("o_merge3__valid").value) == (goes and opcode is Opcode.MERGE3)
        assert bool(self.port("o_merge2__valid").value) == (goes and opcode is Opcode.MERGE2)
        if opcode is not None:
            f = unpack(LAYOUTS[opcode], word)
        if load:
            shape = {name: LAYOUTS[Opcode.LOAD][name].width for name in LOAD}
            assert self._found("o_load", shape) == {name: f[name] for name in LOAD}
        elif goes and opcode is Opcode.MERGE3:
            shape = {name: field.width for name, field in MERGE3}
            assert self._found("o_merge3", shape) == {name: f[name] for name in shape}
        elif goes and opcode is Opcode.MERGE2:
            shape = {name: field.width for name, field in merge2(self.config)}
            want = {name: f[name] for name in shape if name != "node"} | {"node": self.board.node}
            assert self._found("o_merge2", shape) == want

        if loaded:
            self.board.vertex_ready[register] = now() + 1
        if goes:
            self.board.go(now(), word)
            if opcode is Opcode.LOAD:
                self.loading.append(f["v"])
        if new:
            self.board.node = 0
        if steps:
            self.here = coming
        return steps

    def _found(self, port: str, widths: dict[str, int]) -> dict[str, int]:
        bits, fields = self.port(f"{port}__payload").value.to_unsigned(), {}
        for name, width in widths.items():
            fields[name] = bits & (1 << width) - 1
            bits >>= width
        return fields

    async def issue(self, *words) -> list[Stall]:
        """Offer instructions one after the other, None: none; the causes for which they waited."""
        before = self.seen.copy()
        for word in words:
            while not await self.cycle(word):
                assert sum(self.seen.values()) < 10_000, "never goes"
        while self.here is not None:
            await self.cycle()
        waits = self.seen - before
        return [stall for stall in waits.elements() if stall not in (Stall.NONE, Stall.FETCH)]


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(hurry=[0.3, 0.9])
async def any_instructions_at_any_time(dut, hurry):
    """Random instructions, that meet each other at all distances. `hurry`: of all neighbours."""
    bench = Bench(dut)
    await bench.begin()
    registers = bench.config.vertex_registers, bench.config.box_registers

    def random_instruction() -> int:
        opcode = random.choices(list(Opcode), [3, 2, 3, 1])[0]
        pools = [range(n) if random.random() < 0.2 else (0, 1, n - 1) for n in registers]
        operands = {
            name: random.choice(pools["vb".index(name[0])])
            for name, _ in LAYOUTS[opcode]
            if name[0] in "vb" and name != "vertex"
        }
        match opcode:
            case Opcode.LOAD:
                operands["vertex"] = random.getrandbits(VERTEX_BITS)
            case Opcode.MERGE2:
                operands["axis"] = random.randrange(3)
            case Opcode.NODE:
                operands["node"] = random.getrandbits(NODE_BITS)
        return instruction(opcode, **operands)

    word = None
    for _ in range(5000):
        if word is None and random.random() < hurry:
            word = random_instruction()
        went = await bench.cycle(
            word,
            room=random.random() < 0.8,
            load_ready=random.random() < 0.8,
            loaded=bool(bench.loading) and random.random() < 0.4,
            new=bench.here is None and random.random() < 0.1,
        )
        if went:
            word = None
    assert all(bench.seen[stall] >= 10 for stall in Stall), bench.seen


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_box_waits_out_its_merge_at_each_age(dut):
    bench = Bench(dut)
    await bench.begin()
    other = bench.config.box_registers - 1
    writers = (
        instruction(Opcode.MERGE3, b=0, v0=0, v1=1, v2=2),
        instruction(Opcode.MERGE2, b=0, b0=other, b1=other, axis=0),
    )
    for writer in writers:
        for b0, b1 in ((0, other), (other, 0), (0, 0), (other, other)):
            reader = instruction(Opcode.MERGE2, b=other, b0=b0, b1=b1, axis=1)
            for age in range(1, bench.config.box_latency + 2):
                for _ in range(bench.config.box_latency):
                    await bench.cycle()  # nothing under way
                waits = max(0, bench.config.box_latency - age) if 0 in (b0, b1) else 0
                found = await bench.issue(writer, *[None] * (age - 1), reader)
                assert found == [Stall.BOX] * waits


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_vertex_waits_for_its_load(dut):
    bench = Bench(dut)
    await bench.begin()
    last = bench.config.vertex_registers - 1
    readers = [
        instruction(Opcode.MERGE3, b=0, **({"v0": 0, "v1": 1, "v2": 0} | {v: last}))
        for v in ("v0", "v1", "v2")
    ]
    readers.append(instruction(Opcode.LOAD, v=last, vertex=1))
    for reader in readers:
        load = instruction(Opcode.LOAD, v=last, vertex=7)
        other = instruction(Opcode.MERGE3, b=0, v0=0, v1=1, v2=0)  # goes on
        for early in (0, 1):  # the vertex comes as the reader waits, or as it comes itself
            assert not await bench.issue(load, other)
            if not early:
                assert await bench.cycle(reader)
                for _ in range(5):
                    assert not await bench.cycle()
            assert bool(early) == await bench.cycle(reader if early else None, loaded=True)
            assert await bench.cycle(), "one cycle after the vertex came"
            while bench.loading:
                await bench.cycle(loaded=True)
        # Right behind the load.
        assert await bench.cycle(load) and await bench.cycle(reader)
        assert not await bench.cycle()
        assert not await bench.cycle(loaded=True)
        assert await bench.cycle()
        while bench.loading:
            await bench.cycle(loaded=True)


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def counts_nodes(dut):
    bench = Bench(dut)
    await bench.begin()
    last = (1 << NODE_BITS) - 1
    merge = instruction(Opcode.MERGE2, b=0, b0=1, b1=1, axis=2)
    for target in (None, 5, last, 0, 1 << 27):
        if target is not None:
            await bench.issue(instruction(Opcode.NODE, node=target))
        for _ in range(3):
            await bench.issue(merge)  # the scoreboard counts too
    await bench.cycle(new=True)
    assert bench.board.node == 0
    await bench.issue(merge)


@pytest.mark.parametrize("name", NAMES)
def test_contract(name, tmp_path, seed):
    units = SideBySide({name: Issue(CONFIGS[name]) for name in NAMES})
    run_cocotb(units, __name__, tmp_path, seed=seed, CONFIG=name)
