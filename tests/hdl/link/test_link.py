"""hdl.link.link, as Verilog: every command and every line, against a model of a board."""

import os
import random
import struct
from dataclasses import replace

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.link.link import Link
from hdl.link.protocol import BODY_BYTES, VERSION, Kind, Reason
from hdl.records import word_bits
from tests.harness import CONFIGS, one_of, run_cocotb
from tests.hdl.link.host import Line, Registers, encode
from tests.hdl.link.reference import REGISTERS, Board, Frame
from tests.memory import Memory
from tests.streams import start

WORDS = {"tiny": 100, "wide": 1 << 14}
RINGS = {"tiny": 2048, "wide": 4096}
SESSION = 0xBEEF
HELLO, READ, WRITE, PEEK, POKE = (
    Kind[name].value for name in ("HELLO", "READ", "WRITE", "PEEK", "POKE")
)
OK, REFUSED, REPEAT = (Kind[name].value for name in ("OK", "REFUSED", "REPEAT"))
MS = {"timeout_time": 10, "timeout_unit": "ms"}


def link(name: str) -> Link:
    return Link(CONFIGS[name], WORDS[name], RINGS[name])


class Bench:
    """A Link with all that is around it, and the model of what it is to do."""

    def __init__(self, dut, name: str, line_busy: float, memory_busy: float, latency: int):
        self.dut, self.name = dut, name
        config = CONFIGS[name]
        self.word_bytes = word_bits(config.fmt) // 8
        words = {k: random.getrandbits(8 * self.word_bytes) for k in range(WORDS[name])}
        values = [random.getrandbits(32) for _ in range(REGISTERS)]
        self.board = Board(self.word_bytes, dict(words), list(values))
        self.line = Line(dut, name, line_busy)
        self.registers = Registers(dut, name, values)
        self.memory = Memory(dut, f"{name}__port", config, words, latency=latency, busy=memory_busy)

    async def ask(self, kind: int, sequence: int, body: bytes = b"", session: int = SESSION):
        """Send a command, and compare its answer with the model's, which is given."""
        frame = Frame(kind, session, sequence, body)
        expected = self.board.receive(frame)
        assert expected is not None, "this has no answer of its own"
        got = await self.line.ask(frame)
        assert got == expected, f"{frame}: {got}, not {expected}"
        return got

    async def open(self, session: int = SESSION):
        await self.ask(HELLO, 0, bytes([VERSION]), session)

    async def check(self):
        """Nothing is left to say, and memory and registers are what the model has."""
        assert await self.line.take() == []
        assert self.memory.words == self.board.words
        assert self.registers.values == self.board.registers
        assert self.line.pulses["executed"] == self.board.done


async def begin(dut, line_busy: float = 0.0, memory_busy: float = 0.0, latency: int = 2) -> Bench:
    name = os.environ["UNIT"]
    inputs = ("i__valid", "o__ready", "failed", "unsettled", "port__request__ready")
    inputs += ("port__response__valid", "registers__read_data", "registers__missing")
    have = [f"{name}__{x}" for x in inputs if hasattr(dut, f"{name}__{x}")]
    await start(dut, **dict.fromkeys(have, 0))
    bench = Bench(dut, name, line_busy, memory_busy, latency)
    for part in (bench.line, bench.registers, bench.memory):
        cocotb.start_soon(part.run())
    return bench


def read(address: int, count: int, first: int, size: int) -> bytes:
    return struct.pack("<IHBB", address, count, first, size)


def run(address: int, count: int, size: int) -> bytes:
    return struct.pack("<IH", address, count) + random.randbytes(count * size)


def write(first: int, size: int, *runs: tuple[int, int]) -> bytes:
    return bytes([first, size]) + b"".join(run(address, count, size) for address, count in runs)


def peek(register: int, count: int) -> bytes:
    return struct.pack("<HH", register, count)


def poke(register: int, count: int) -> bytes:
    return struct.pack("<H", register) + random.randbytes(4 * count)


@cocotb.test(**MS)
@cocotb.parametrize((("busy", "latency"), [(0.0, 2), (0.6, 7)]))
async def every_command(dut, busy, latency):
    bench = await begin(dut, busy, busy, latency)
    size, words = bench.word_bytes, WORDS[bench.name]
    await bench.open()
    bodies = [
        (READ, read(0, 1, 0, size)),
        (READ, read(words - 1, 1, size - 1, 1)),
        (READ, read(words - 30, 30, 3, 5)),
        (READ, read(7, BODY_BYTES // size, 0, size)),  # the longest answer
        (WRITE, write(0, size, (0, 1))),
        (WRITE, write(size - 1, 1, (words - 1, 1))),
        (WRITE, write(2, 7, (3, 2), (words - 9, 9), (3, 1), (50, 3))),
        (WRITE, bytes([0, size])),  # no run
        (WRITE, write(0, 1, (9, 64), (0, 5))),
        (WRITE, write(0, 12, (10, (BODY_BYTES - 8) // 12)) + b""),
        (READ, read(0, 64, 0, 12)),
        (PEEK, peek(0, 1)),
        (PEEK, peek(REGISTERS - 1, 1)),
        (PEEK, peek(5, BODY_BYTES // 4)),
        (POKE, poke(0, 1)),
        (POKE, poke(REGISTERS - 3, 3)),
        (POKE, poke(17, 255)),
        (POKE, poke(REGISTERS, 0)),
        (PEEK, peek(REGISTERS - 256, 256)),
    ]
    for number, (kind, body) in enumerate(bodies, 1):
        assert (await bench.ask(kind, number, body)).kind == OK
    await bench.check()


@cocotb.test(**MS)
async def every_fault(dut):
    """Each is refused for its reason, and the command after it works."""
    bench = await begin(dut)
    size, words = bench.word_bytes, WORDS[bench.name]
    faults = [
        (Reason.KIND, 0x00, b""),
        (Reason.KIND, 0x06, b"1234"),
        (Reason.KIND, 0x80, bytes(300)),
        (Reason.KIND, 0xFF, b""),
        (Reason.LENGTH, READ, read(0, 1, 0, 1)[:-1]),
        (Reason.LENGTH, READ, read(0, 1, 0, 1) + b"0"),
        (Reason.LENGTH, READ, b""),
        (Reason.LENGTH, READ, bytes(8 + 256)),
        (Reason.LENGTH, READ, read(0, BODY_BYTES // size + 1, 0, size)),
        (Reason.LENGTH, READ, read(2, 93, 0, 12)),
        (Reason.RANGE, READ, read(0, 0, 0, 1)),
        (Reason.RANGE, READ, read(0, 1, 0, 0)),
        (Reason.RANGE, READ, read(words, 1, 0, 1)),
        (Reason.RANGE, READ, read(words - 1, 2, 0, 1)),
        (Reason.RANGE, READ, read(1, 0xFFFF, 0, 1)),
        (Reason.RANGE, READ, read(0x80000000, 1, 0, 1)),
        (Reason.RANGE, READ, read(0xFFFFFFFF, 1, 0, 1)),
        (Reason.RANGE, READ, read(0xFFFFFFFF, 0xFFFF, 0, 1)),
        (Reason.RANGE, READ, read(1 << CONFIGS[bench.name].address_bits, 1, 0, 1)),
        (Reason.RANGE, READ, read(0, 1, size, 1)),
        (Reason.RANGE, READ, read(0, 1, 1, size)),
        (Reason.RANGE, READ, read(0, 1, 255, 255)),
        (Reason.RANGE, READ, read(0, 1, 0, size + 1)),
        (Reason.LENGTH, WRITE, b""),
        (Reason.LENGTH, WRITE, b"\0"),
        (Reason.LENGTH, WRITE, bytes([0, size]) + bytes(5)),
        (Reason.LENGTH, WRITE, write(0, 3, (5, 2), (20, 4))[:-1]),
        (Reason.LENGTH, WRITE, write(0, 3, (5, 2), (20, 4)) + b"0"),
        (Reason.LENGTH, WRITE, bytes([0, 4]) + struct.pack("<IH", 0, 9)),
        (Reason.LENGTH, WRITE, bytes([0, 1]) + struct.pack("<IH", 0, 60) + bytes(BODY_BYTES)),
        (Reason.RANGE, WRITE, write(0, 4, (8, 2), (words - 1, 2), (1, 1))),
        (Reason.RANGE, WRITE, write(0, 4, (3, 1), (4, 0), (1, 1))),
        (Reason.RANGE, WRITE, write(size - 3, 4, (8, 2))),
        (Reason.RANGE, WRITE, write(0, 0, (8, 2))),
        (Reason.RANGE, WRITE, write(0, 4, (0xFFFFFFF0, 50))),
        (Reason.LENGTH, PEEK, b""),
        (Reason.LENGTH, PEEK, peek(0, 1) + b"0"),
        (Reason.LENGTH, PEEK, peek(0, 257)),
        (Reason.LENGTH, PEEK, peek(0, REGISTERS)),
        (Reason.RANGE, PEEK, peek(0, 0)),
        (Reason.RANGE, PEEK, peek(REGISTERS, 1)),
        (Reason.RANGE, PEEK, peek(REGISTERS - 2, 3)),
        (Reason.RANGE, PEEK, peek(0xFFFF, 0xFFFF)),
        (Reason.LENGTH, POKE, b""),
        (Reason.LENGTH, POKE, b"0"),
        *((Reason.LENGTH, POKE, poke(4, 2)[:-k]) for k in (1, 2, 3)),
        (Reason.LENGTH, POKE, poke(4, 256)),
        (Reason.RANGE, POKE, poke(REGISTERS, 1)),
        (Reason.RANGE, POKE, poke(REGISTERS - 2, 3)),
        (Reason.RANGE, POKE, poke(0xFFFF, 1)),
    ]
    await bench.open()
    for number, (reason, kind, body) in enumerate(faults, 1):
        refused = await bench.ask(kind, number, body)
        assert refused.body == bytes([reason.value]), f"{Kind(kind)} {body[:16].hex()}"
        await bench.ask(WRITE, number, write(1, 2, (number, 1)))
        await bench.ask(READ, number, read(number, 1, 0, size))  # a repetition
    await bench.check()


@cocotb.test(**MS)
async def sessions(dut):
    bench = await begin(dut)
    hello = bytes([VERSION])
    for kind in (READ, 0x77):  # there is no session yet, not even of number 0
        refused = await bench.ask(kind, 0, read(0, 1, 0, 1), 0)
        assert refused == Frame(REFUSED, 0, 0, bytes([Reason.SESSION.value]))
    answer = await bench.ask(HELLO, 0, bytes([VERSION + 1]))  # another version opens none
    assert answer.kind == OK and answer.body == b"TDKB" + struct.pack("<BH", VERSION, BODY_BYTES)
    assert (await bench.ask(READ, 1, read(0, 1, 0, 1))).kind == REFUSED
    for body in (b"", b"\1\1", bytes(1000)):
        assert (await bench.ask(HELLO, 0, body)).body == bytes([Reason.LENGTH.value])
    assert (await bench.ask(READ, 1, read(0, 1, 0, 1))).kind == REFUSED
    await bench.open(0)  # a session like others
    await bench.ask(POKE, 1, poke(0, 2), 0)
    await bench.ask(HELLO, 5, hello, 0)  # as it is: 2 is expected
    await bench.ask(HELLO, 2, hello, 0)
    assert (await bench.ask(POKE, 2, poke(0, 2), 0)).kind == OK
    assert (await bench.ask(POKE, 3, poke(0, 2), 1)).kind == REFUSED
    await bench.ask(HELLO, 0, bytes([VERSION + 1]), 1)
    await bench.ask(POKE, 3, poke(0, 2), 0)
    await bench.open(0xFFFF)
    assert (await bench.ask(POKE, 4, poke(0, 2), 0)).kind == REFUSED
    await bench.ask(POKE, 1, poke(0, 2), 0xFFFF)
    await bench.check()


@cocotb.test(**MS)
async def repetitions(dut):
    """READ and PEEK tell what is there now; WRITE and POKE do nothing twice."""
    bench = await begin(dut)
    await bench.open()
    await bench.ask(WRITE, 1, write(0, 4, (5, 1)))
    await bench.ask(POKE, 2, poke(5, 1))
    done = len(bench.memory.requests), bench.registers.writes
    for body in (write(0, 4, (5, 1)), b"", bytes(1500)):
        assert (await bench.ask(WRITE, 1, body)).kind == OK
        assert (await bench.ask(POKE, 2, body)).kind == OK
    assert (await bench.ask(WRITE, 3 - (1 << 15) & 0xFFFF, write(0, 4, (5, 1)))).kind == OK
    assert (len(bench.memory.requests), bench.registers.writes) == done
    await bench.ask(READ, 1, read(5, 1, 0, 4))
    await bench.ask(PEEK, 0, peek(5, 1))
    assert (await bench.ask(READ, 1, read(0, 0, 0, 4))).kind == REFUSED
    assert (await bench.ask(0x33, 1)).body == bytes([Reason.KIND.value])
    await bench.ask(READ, 3, read(5, 1, 0, 4))
    await bench.check()


async def expect_repeat(bench, sequence: int, most: int = 1):
    """A REPEAT comes, and nothing else."""
    got = await bench.line.take(1)
    assert got == [bench.board.repeat()] * len(got) and len(got) <= most
    assert bench.board.expected == sequence


@cocotb.test(**MS)
async def what_is_missing_is_asked_for(dut):
    bench = await begin(dut)
    board, line = bench.board, bench.line
    whole = encode(Frame(READ, SESSION, 1, read(0, 1, 0, 1)))
    await line.send(b"\5\1\2\0" + whole[:9] + b"\0")
    assert await line.take() == []  # there is no session
    assert line.pulses["damaged"] == 2
    await bench.open()
    for body in (READ, read(0, 1, 0, 1)), (WRITE, write(0, 2, (0, 2))), (0x99, b""):
        for number in (2, 3, 1 << 15, 1 + (1 << 15) - 1):
            frame = Frame(body[0], SESSION, number, body[1])
            assert board.receive(frame) is None
            await line.send(encode(frame))
            await expect_repeat(bench, 1)
    for k in range(len(whole) - 1):  # any byte wrong, or lost, or one more
        bad = bytes([whole[k] ^ random.choice([1, 2, 4, 8, 16, 32, 64, 128])])
        for damaged in (whole[:k] + bad, whole[:k], whole[:k] + b"\1" + whole[k : k + 1]):
            await line.send(damaged + whole[k + 1 :])
            board.drop()
            await expect_repeat(bench, 1, most=2)  # what is cut in two can count twice
    for length in (0, 7, 9, 0xFFFF):  # the header says another length
        await line.send(encode(Frame(READ, SESSION, 1, read(0, 1, 0, 1)), length=length))
        board.drop()
        await expect_repeat(bench, 1)
    frames = [Frame(READ, SESSION, k, read(k, 1, 0, 4)) for k in (1, 3, 4, 5)]
    got = [board.receive(frame) for frame in frames]
    await line.send(b"".join(map(encode, frames)))  # one REPEAT for all
    assert await line.take(2) == [got[0], board.repeat()]
    await bench.ask(READ, 2, read(2, 1, 0, 4))
    await bench.check()


@cocotb.test(**MS)
async def no_room(dut):
    """What does not fit is lost and asked for; what did fit is answered."""
    bench = await begin(dut)
    board, line = bench.board, bench.line
    await bench.open()
    line.busy = 1.0  # no answer leaves
    size = 24
    frames = [Frame(PEEK, SESSION, k, peek(k, 200)) for k in range(1, 5)]
    frames += [
        Frame(WRITE, SESSION, k, write(0, size, (k, 1), (2 * k, 30)))
        if size <= bench.word_bytes
        else Frame(WRITE, SESSION, k, write(0, size // 2, (k, 1), (k, 60)))
        for k in range(5, 30)
    ]
    await line.send(b"".join(map(encode, frames)))
    for _ in range(1000):
        await RisingEdge(dut.clk)
    lost = line.pulses["lost"]
    kept = len(frames) - lost
    assert 5 < kept < len(frames) and not line.pulses["damaged"]
    fits = RINGS[bench.name] // len(encode(frames[-1]))
    assert kept in (5 + fits, 4 + fits, 3 + fits, 6 + fits)
    line.busy = 0.0
    expected = [board.receive(frame) for frame in frames[:kept]]
    board.drop()
    got = await line.take(kept + 1)
    assert got == [*expected, board.repeat()]
    await line.send(encode(Frame(WRITE, SESSION, kept + 1, bytes(RINGS[bench.name]))))  # never fits
    board.drop()
    await expect_repeat(bench, kept + 1)
    assert line.pulses["lost"] == lost + 1
    await bench.ask(READ, kept + 1, read(0, 50, 0, 4))
    await bench.check()


@cocotb.test(**MS)
async def errors_of_the_memory(dut):
    bench = await begin(dut, latency=30)
    failed = getattr(dut, f"{bench.name}__failed")

    async def fail(after: int):
        for _ in range(after):
            await RisingEdge(dut.clk)
        failed.value = 1
        await RisingEdge(dut.clk)
        failed.value = 0

    await bench.open()
    await fail(5)  # between commands: of no meaning
    number = 1
    memory = bytes([Reason.MEMORY.value])
    for kind, body in [
        (READ, read(0, 9, 0, 8)),
        (WRITE, write(0, 8, (0, 9))),
        (PEEK, peek(0, 30)),
        (POKE, poke(0, 20)),
    ]:
        await bench.ask(kind, number, body)
        number += 1
        frame = Frame(kind, SESSION, number, body)
        asking = cocotb.start_soon(bench.line.ask(frame))
        await fail(len(encode(frame)) + 60)
        expected = bench.board.receive(frame)
        if kind in (READ, WRITE):
            bench.board.expected -= 1  # it was at fault
            bench.board.done -= 1
            assert await asking == Frame(REFUSED, SESSION, number, memory)
            await bench.ask(kind, number, body)
        else:
            assert await asking == expected
        number += 1
        if kind == WRITE:  # again, without effect: an error is not its own
            asking = cocotb.start_soon(bench.line.ask(replace(frame, sequence=number - 1)))
            await fail(len(encode(frame)) + 20)
            assert (await asking).kind == OK
    await bench.check()


@cocotb.test(**MS)
async def a_write_is_answered_when_it_has_settled(dut):
    bench = await begin(dut)
    failed, unsettled = (getattr(dut, f"{bench.name}__{x}") for x in ("failed", "unsettled"))
    await bench.open()
    for error in ("before the end", "with the end", None):
        frame = Frame(WRITE, SESSION, 1, write(0, 8, (0, 3)))
        taken = len(bench.memory.requests)
        await bench.line.send(encode(frame))
        while len(bench.memory.requests) < taken + 3:
            await RisingEdge(dut.clk)
        unsettled.value = 1  # two cycles after the write, as its contract is
        for _ in range(500):
            await RisingEdge(dut.clk)
        assert not bench.line.answers
        if error == "before the end":
            failed.value = 1
            await RisingEdge(dut.clk)
            failed.value = 0
        unsettled.value = 0
        failed.value = error == "with the end"
        await RisingEdge(dut.clk)
        failed.value = 0
        answer = bench.board.receive(frame)
        if error:
            bench.board.expected -= 1
            bench.board.done -= 1
            answer = Frame(REFUSED, SESSION, 1, bytes([Reason.MEMORY.value]))
        assert await bench.line.take(1) == [answer]
    unsettled.value = 1  # of others: a READ goes on
    await bench.ask(READ, 2, read(0, 3, 0, 8))
    await bench.ask(WRITE, 1, b"")  # a repetition was answered before
    unsettled.value = 0
    await bench.check()


def a_command(bench: Bench) -> tuple[int, bytes]:
    """Any, most of them without a fault."""
    size, words = bench.word_bytes, WORDS[bench.name]
    kind = random.choice([READ, WRITE, PEEK, POKE])
    if random.random() < 0.1:
        return random.choice([kind, random.randrange(1, 256)]), random.randbytes(
            random.choice([0, 1, 2, 4, 8, 14, 40, 300])
        )
    first = random.randrange(size)
    width = random.randint(1, size - first + (random.random() < 0.05))
    at = lambda most: random.choice([0, random.randrange(most), most - random.randint(1, 12)])  # noqa: E731
    if kind == READ:
        return kind, read(at(words), random.randint(1, 12), first, width)
    if kind == WRITE:
        runs = [(at(words), random.randint(1, 6)) for _ in range(random.randrange(4))]
        return kind, write(first, width, *runs)
    if kind == PEEK:
        return kind, peek(at(REGISTERS), random.randint(1, 12))
    return kind, poke(at(REGISTERS), random.randint(0, 12))


@cocotb.test(timeout_time=100, timeout_unit="ms")
@cocotb.parametrize((("busy", "latency"), [(0.0, 1), (0.5, 9)]))
async def bad_lines(dut, busy, latency):
    """Commands that are doubled, dropped, damaged, reordered; each answer is the model's."""
    bench = await begin(dut, busy / 3, busy, latency)
    board, line = bench.board, bench.line
    session = SESSION
    await bench.open()
    for _ in range(int(os.environ["STEPS"])):
        frames = []
        number = board.expected
        for _ in range(random.randint(1, 6)):
            kind, body = a_command(bench)
            ahead = random.choice([0] * 20 + [-1, -2, 1, 5, 0x7FFF, 0x8000, 0x8001])
            other = session if random.random() < 0.97 else random.getrandbits(16)
            frames.append(Frame(kind, other, (number + ahead) & 0xFFFF, body))
            number = (number + 1) & 0xFFFF
            frames += frames[-1:] * (random.random() < 0.1)
        if random.random() < 0.1:
            frames.pop(random.randrange(len(frames)))
        if random.random() < 0.1:
            random.shuffle(frames)
        if random.random() < 0.1:
            session = random.choice([session, random.getrandbits(16)])
            version = random.choice([VERSION] * 5 + [9])
            frames.append(Frame(HELLO, session, 0, bytes([version])))
        expected, said, asked = [], [], None  # what a REPEAT can say, from when on one has to come
        for frame in frames:
            sent = bytearray(encode(frame))
            if random.random() < 0.05:
                at = random.randrange(len(sent))
                sent[at] ^= 1 << random.randrange(8)
                sent += b"\0"  # it may have been the zero byte
                board.drop()
            else:
                expected += [answer for answer in [board.receive(frame)] if answer]
            said.append(Frame(REPEAT, board.session, board.expected))
            if board.repeat():
                asked = len(said) - 1
            await line.send(bytes(sent), busy)
        while sum(answer.kind != REPEAT for answer in line.answers) < len(expected):
            await RisingEdge(dut.clk)
        got = await line.take(cycles=1200)  # what is not answered takes a cycle a byte
        assert [answer for answer in got if answer.kind != REPEAT] == expected
        # One for each that is asked for, or one for all, but none before what it follows.
        repeats = [answer for answer in got if answer.kind == REPEAT]
        if asked is None:
            assert not repeats
        else:
            assert repeats and repeats[-1] in said[asked:] and set(repeats) <= set(said)
        session = board.session
    await bench.check()


@cocotb.test(timeout_time=100, timeout_unit="ms")
async def garbage(dut):
    """Nothing but whole frames is executed, and these are."""
    bench = await begin(dut)
    board, line = bench.board, bench.line
    await bench.open()
    left = int(os.environ["GARBAGE"])
    while left > 0:
        noise = random.randbytes(random.choice([1, 10, 100, 5000]))
        if random.random() < 0.3:  # with few zero bytes, or many
            noise = noise.replace(b"\0", b"\1") if random.random() < 0.5 else noise + bytes(50)
        left -= len(noise)
        await line.send(noise + b"\0")
        got = await line.take()
        assert all(answer.kind == REPEAT for answer in got)
        kind, body = a_command(bench)
        if kind != HELLO:
            await bench.ask(kind, board.expected, body)
    await bench.check()


def simulate(name: str, work, seed: int, **env):
    run_cocotb(
        one_of(link, {n: n for n in WORDS}, name), __name__, work, seed=seed, UNIT=name, **env
    )


@pytest.mark.parametrize("name", WORDS)
def test_contract(name, tmp_path, seed):
    simulate(name, tmp_path, seed, STEPS=6, GARBAGE=4000)


@pytest.mark.slow
@pytest.mark.parametrize("name", WORDS)
def test_long(name, tmp_path, seed):
    only = {"COCOTB_TEST_FILTER": "bad_lines|garbage"}
    simulate(name, tmp_path, seed + 1, STEPS=150, GARBAGE=100_000, **only)


@pytest.mark.parametrize(("words", "ring"), [(0, 4096), (1 << 13, 4096), (9, 1024), (9, 3000)])
def test_sizes_that_are_none(words, ring):
    with pytest.raises(ValueError, match="words|ring"):
        Link(CONFIGS["tiny"], words, ring)
