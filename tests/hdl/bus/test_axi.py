"""hdl.bus.axi, as Verilog, on the memory of cocotbext-axi."""

import os
import random

import cocotb
import pytest
from cocotb.triggers import RisingEdge

from hdl.bus.axi import AxiMaster
from hdl.bus.gather import BEATS, PAGE
from hdl.memory.port import request
from hdl.records import word_bits
from tests.axi import WARNINGS, Ram
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.memory import Request, written
from tests.payloads import unpack
from tests.streams import collect, now, put, start

UNITS = ("smallest", "tiny", "wide")
OUTSTANDING = 40


class Bench:
    """The master under test, its memory of random words, and what it should be."""

    def __init__(self, dut, stalls: float):
        self.dut, self.name = dut, os.environ["UNIT"]
        self.config = CONFIGS[self.name]
        self.layout = request(self.config)
        self.bits = word_bits(self.config.fmt)
        self.bytes = self.bits // 8
        self.size = 1 << self.config.address_bits
        self.ram = Ram(dut, f"{self.name}__axi_", self.size * self.bytes, stalls)
        self.words = {}
        for address in range(self.size):
            self.words[address] = random.getrandbits(self.bits)
            self.ram.memory.write(
                address * self.bytes, self.words[address].to_bytes(self.bytes, "little")
            )

    @classmethod
    async def begin(cls, dut, stalls: float = 0.0) -> "Bench":
        name = os.environ["UNIT"]
        inputs = {"port__request__valid": 0, "flush": 0}
        await start(dut, **{f"{name}__{port}": value for port, value in inputs.items()})
        return cls(dut, stalls)  # after the reset: cocotbext.axi takes no signal that is unknown

    def __getattr__(self, name: str):
        return getattr(self.dut, f"{self.name}__{name}")

    def in_memory(self, address: int) -> int:
        data = self.ram.memory.read(address * self.bytes, self.bytes)
        return int.from_bytes(data, "little")

    def asks(self, addresses, writes: bool) -> list[int]:
        """Payloads that read words, or write random bytes of them."""
        return [
            self.layout.const({
                "address": address,
                "write": writes,
                "mask": random.choice([-1, random.getrandbits(self.bytes)]) % (1 << self.bytes),
                "data": random.getrandbits(self.bits),
            }).as_bits()
            for address in addresses
        ]

    def write_down(self, payloads):
        """Do writes to the words that there should be."""
        for bits in payloads:
            asked = Request(0, **unpack(self.layout, bits))
            if asked.write:
                self.words[asked.address] = written(self.words[asked.address], asked)

    async def put(self, payloads, idle: float = 0.0):
        await put(self.dut, f"{self.name}__port__request", payloads, idle)

    async def collect(self, *arguments):
        return await collect(self.dut, f"{self.name}__port__response", *arguments)

    async def until(self, signal: str, most: int = 500):
        """The cycles until a signal is high."""
        begin = now()
        await RisingEdge(self.dut.clk)
        while not getattr(self, signal).value:
            assert now() - begin < most, f"{signal} stays low"
            await RisingEdge(self.dut.clk)

    async def watch_settled(self):
        """Where the master says so, every write that it has taken is in memory."""
        taken = []
        valid, ready, payload = (
            getattr(self, f"port__request__{part}") for part in ("valid", "ready", "payload")
        )
        settled = self.settled
        last = self.axi__wvalid, self.axi__wready, self.axi__wlast
        answer = self.axi__bvalid, self.axi__bready
        unanswered = 0
        while True:
            await RisingEdge(self.dut.clk)
            if settled.value:
                assert not unanswered, "settled before the memory says so"
                for address in {unpack(self.layout, bits)["address"] for bits in taken}:
                    assert self.in_memory(address) == self.words[address], f"word {address}"
                taken = []
            unanswered += all(signal.value for signal in last)
            unanswered -= all(signal.value for signal in answer)
            if valid.value and ready.value:
                bits = payload.value.to_unsigned()
                if unpack(self.layout, bits)["write"]:
                    self.write_down([bits])
                    taken.append(bits)


def runs(low: int, high: int, count: int) -> list[int]:
    """Addresses with neighbours now and then: within [low, high), and in runs of all lengths."""
    found = []
    while len(found) < count:
        begin = random.randrange(low, high)
        found += range(begin, min(high, begin + random.choice([1, 1, 2, 5, 16, 40])))
    return found[:count]


@cocotb.test(timeout_time=2, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.5], idle=[0.0, 0.4])
async def every_word_is_right(dut, stalls, idle):
    bench = await Bench.begin(dut, stalls)
    half = bench.size // 2
    cocotb.start_soon(bench.watch_settled())
    for turn in range(4):  # what one turn wrote the next one reads
        first, second = (0, half) if turn % 2 else (half, 0)
        reads = bench.asks(runs(first, first + half, 250), writes=False)
        writes = bench.asks(runs(second, second + half, 250), writes=True)
        mixed = []
        while reads or writes:  # runs of either kind
            kind = random.choice([k for k in (reads, writes) if k])
            share = random.choice([1, 3, 30])
            mixed += kind[:share]
            del kind[:share]
        asked = [unpack(bench.layout, bits) for bits in mixed]
        expected = [bench.words[a["address"]] for a in asked if not a["write"]]
        sender = cocotb.start_soon(bench.put(mixed, idle))
        assert await bench.collect(len(expected)) == expected
        await sender
        await bench.until("settled")
        assert bench.idle.value
    assert all(bench.in_memory(address) == word for address, word in bench.words.items())


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(writes=[False, True])
async def streams_are_bursts_of_a_word_a_cycle(dut, writes):
    bench = await Bench.begin(dut)
    page = PAGE // bench.bytes
    count = min(160, bench.size)
    first = max(0, min(page, bench.size) - count + 37 - count % 37) % bench.size
    addresses = [(first + k) % bench.size for k in range(count)]
    bench.write_down(payloads := bench.asks(addresses, writes))
    begin = now()
    sender = cocotb.start_soon(bench.put(payloads))
    if writes:
        await sender
        assert now() - begin <= count + len(bench.ram.writes) + 5  # the memory rests after each
        await bench.until("settled")
        assert all(bench.in_memory(address) == bench.words[address] for address in addresses)
    else:
        cycles: list[int] = []
        found = await bench.collect(count, cycles)
        assert found == [bench.words[address] for address in addresses]
        assert cycles[-1] - begin <= count + 30
    bursts = bench.ram.writes if writes else bench.ram.reads
    assert sum(words for _, _, words in bursts) == count
    whole = [BEATS if k % BEATS == 0 else 0 for k in range(count)]
    assert len(bursts) <= whole.count(BEATS) + 3, f"{bursts}"


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def a_lone_read_takes_two_cycles_to_the_bus(dut):
    bench = await Bench.begin(dut)
    for address in (3, 7, 8):
        await bench.put(bench.asks([address], writes=False))
        sent = now()
        await RisingEdge(dut.clk)
        await RisingEdge(dut.clk)
        assert bench.axi__arvalid.value and now() == sent + 2
        assert await bench.collect(1) == [bench.words[address]]


@cocotb.test(timeout_time=1, timeout_unit="ms")
async def no_more_reads_than_it_may_are_under_way(dut):
    bench = await Bench.begin(dut)
    addresses = [k % bench.size for k in range(2 * OUTSTANDING)]
    sender = cocotb.start_soon(bench.put(bench.asks(addresses, writes=False)))
    bench.ram.read_if.r_channel.pause = True
    for _ in range(4 * OUTSTANDING):  # no response comes
        await RisingEdge(dut.clk)
    assert sum(words for _, _, words in bench.ram.reads) == OUTSTANDING
    bench.ram.read_if.r_channel.pause = False
    await bench.collect(len(addresses))
    await sender


@cocotb.test(timeout_time=1, timeout_unit="ms")
@cocotb.parametrize(writes=[False, True])
async def errors_are_told(dut, writes):
    bench = await Bench.begin(dut, 0.2)
    bad = 9
    faults = bench.ram.write_faults if writes else bench.ram.read_faults
    faults.update(range(bad * bench.bytes, (bad + 1) * bench.bytes))
    addresses = [3, 4, *range(8, 12), 5, bad, 2]
    payloads = bench.asks(addresses, writes)
    if writes:
        payloads = [bits | bench.layout.const({"mask": -1}).as_bits() for bits in payloads]
    told = {False: 0, True: 0}

    async def count():
        while True:
            await RisingEdge(dut.clk)
            told[False] += int(bench.read_failed.value)
            told[True] += int(bench.write_failed.value)

    cocotb.start_soon(count())
    sender = cocotb.start_soon(bench.put(payloads))
    if not writes:
        await bench.collect(len(addresses))
    await sender
    await bench.until("idle")
    assert told == {writes: addresses.count(bad), not writes: 0}


@cocotb.test(timeout_time=4, timeout_unit="ms")
@cocotb.parametrize(stalls=[0.0, 0.5])
async def a_flush_ends_what_is_under_way(dut, stalls):
    bench = await Bench.begin(dut, stalls)
    for _ in range(30):
        kinds = [bench.asks(runs(0, bench.size, 30), writes) for writes in (False, True)]
        mixed = [bits for pair in zip(*kinds, strict=True) for bits in pair]
        sender = cocotb.start_soon(bench.put(random.choice([mixed, *kinds])))
        for _ in range(random.randrange(1, 40)):
            await RisingEdge(dut.clk)
        sender.cancel()
        bench.port__request__valid.value = 0
        bench.flush.value = 1
        begin = now()
        await RisingEdge(dut.clk)
        while not bench.idle.value:
            assert not bench.port__response__valid.value and not bench.port__request__ready.value
            assert now() - begin < 1000
            await RisingEdge(dut.clk)
        bench.flush.value = 0
        await RisingEdge(dut.clk)
        some = random.randrange(bench.size)
        await bench.put(bench.asks([some], writes=False))
        assert await bench.collect(1) == [bench.in_memory(some)]


@pytest.mark.parametrize("name", UNITS)
def test_contract(name, tmp_path, seed):
    units = SideBySide({name: AxiMaster(CONFIGS[name], OUTSTANDING) for name in UNITS})
    run_cocotb(units, __name__, tmp_path, seed=seed, UNIT=name, PYTHONWARNINGS=WARNINGS)
