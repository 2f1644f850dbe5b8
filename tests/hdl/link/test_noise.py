"""hdl.link.link, as Verilog: millions of random bytes, of which it executes nothing."""

import os
import random

import cocotb
import pytest
from amaranth import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out
from cocotb.triggers import RisingEdge, Timer

from hdl.link.link import Link
from hdl.link.protocol import VERSION, Kind
from hdl.memory.onchip import OnChip
from sim.cosim import verilate
from tests.harness import CONFIGS, SideBySide, run_cocotb
from tests.hdl.link.host import Line
from tests.hdl.link.reference import Frame
from tests.streams import CYCLE, start

WORDS = 64
BYTES = 10_000_000 if verilate.simulator() == "verilator" else 200_000
SESSION = 0x600D


class Noisy(wiring.Component):
    """A Link before a memory, on a line that gives a random byte in each cycle with `noise`.

    So that Python sleeps meanwhile. Counts what happens then; no answer waits.

    Members
    -------
    i : In(stream of bytes), taken at once, without noise
    o : Out(stream of bytes), without noise
    noise : In(1)
    seed : In(32), of the noise: taken without it
    commands, frames, touched : Out(32), in noise: executed; dropped; accesses
    damaged, lost, executed : Out(1), of the link
    """

    def __init__(self):
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            "o": Out(stream.Signature(8)),
            "noise": In(1),
            "seed": In(32),
            **dict.fromkeys(("commands", "frames", "touched"), Out(32)),
            **dict.fromkeys(("damaged", "lost", "executed"), Out(1)),
        })

    def elaborate(self, platform):
        m = Module()
        config = CONFIGS["tiny"]
        m.submodules.link = link = Link(config, WORDS, 2048)
        m.submodules.memory = memory = OnChip(config, words=WORDS)
        wiring.connect(m, link.port, memory.port)

        # G. Marsaglia, "Xorshift RNGs", Journal of Statistical Software 8(14), 2003.
        state, first, second = Signal(32), Signal(32), Signal(32)
        m.d.comb += [
            first.eq(state ^ (state << 13)),
            second.eq(first ^ (first >> 17)),
        ]
        m.d.sync += state.eq(Mux(self.noise, second ^ (second << 5), self.seed))
        m.d.comb += [
            link.i.valid.eq(self.noise | self.i.valid),
            link.i.payload.eq(Mux(self.noise, state[:8], self.i.payload)),
            self.o.valid.eq(link.o.valid & ~self.noise),
            self.o.payload.eq(link.o.payload),
            link.o.ready.eq(self.noise | self.o.ready),
            *(getattr(self, x).eq(getattr(link, x)) for x in ("damaged", "lost", "executed")),
        ]
        with m.If(self.noise):
            m.d.sync += [
                self.commands.eq(self.commands + link.executed),
                self.frames.eq(self.frames + (link.damaged | link.lost)),
                self.touched.eq(self.touched + (link.registers.write | (link.port.request.valid))),
            ]
        return m


@cocotb.test(
    timeout_time=(int(os.environ.get("BYTES", 0)) * CYCLE) // 1_000_000 + 1, timeout_unit="ms"
)
@cocotb.parametrize(session=[False, True])
async def nothing_comes_of_noise(dut, session):
    """And the first whole frame after it is executed."""
    inputs = dict.fromkeys(("noisy__i__valid", "noisy__o__ready", "noisy__noise"), 0)
    await start(dut, **inputs, noisy__seed=random.getrandbits(32) | 1)
    line = Line(dut, "noisy")
    listening = cocotb.start_soon(line.run())
    hello = Frame(Kind.HELLO.value, SESSION, 0, bytes([VERSION]))
    poke = Frame(Kind.POKE.value, SESSION, 1, b"\0\0abcd")
    if session:
        await line.ask(hello)
    listening.cancel()
    count = int(os.environ["BYTES"])
    await RisingEdge(dut.clk)
    dut.noisy__noise.value = 1
    await Timer(count * CYCLE, "ns")
    await RisingEdge(dut.clk)
    counted = {
        name: int(getattr(dut, f"noisy__{name}").value)
        for name in ("commands", "frames", "touched")
    }
    assert counted["commands"] == counted["touched"] == 0
    assert counted["frames"] == pytest.approx(count / 256, rel=0.9)  # the zero bytes in it
    dut.noisy__noise.value = 0
    line = Line(dut, "noisy")
    await RisingEdge(dut.clk)
    dut.noisy__o__ready.value = 1
    await Timer(2000 * CYCLE, "ns")
    await RisingEdge(dut.clk)
    cocotb.start_soon(line.run())
    await line.send(b"\0")
    await line.take()
    if not session:
        assert (await line.ask(hello)).kind == Kind.OK.value
    assert await line.ask(poke) == Frame(Kind.OK.value, SESSION, 1)


def simulate(work, seed: int, count: int):
    run_cocotb(SideBySide({"noisy": Noisy()}), __name__, work, seed=seed, BYTES=count)


def test_contract(tmp_path, seed):
    simulate(tmp_path, seed, 20_000)


@pytest.mark.slow
def test_long(tmp_path, seed):
    simulate(tmp_path, seed + 1, BYTES)
