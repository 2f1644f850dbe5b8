"""What a processor and its memory do with a machine on AXI."""

from cocotb.triggers import RisingEdge
from cocotbext.axi import AxiLiteBus, AxiLiteMaster, AxiResp

from hdl.config import Config
from hdl.registers import CONTROL, STATUS, Outcome, registers
from tests.axi import Ram, pauses
from tests.fpga.jobs import Run
from tests.streams import now, start

CONTROL_BITS = {name: CONTROL.const({name: 1}).as_bits() for name, _ in CONTROL}
DONE = STATUS.const({"done": 1}).as_bits()
MOST = 200_000
"""Cycles that no run takes."""

CUT_SHORT = 600
"""Cycles to the end of a run from when it is cut short: what is under way, at half speed."""


class Driver:
    """Memory and processor around a machine.

    Attributes
    ----------
    ram : Ram
    """

    def __init__(self, dut, config: Config, size: int, stalls: float):
        self.dut = dut
        self.registers = {register.name: register for register in registers(config)}
        self.ram = Ram(dut, "m_axi", size, stalls)
        self.master = AxiLiteMaster(AxiLiteBus.from_prefix(dut, "s_axi"), dut.clk, dut.rst)
        write, read = self.master.write_if, self.master.read_if
        for channel in (
            write.aw_channel, write.w_channel, write.b_channel, read.ar_channel, read.r_channel,
        ):  # fmt: skip
            channel.set_pause_generator(pauses(stalls) if stalls else None)

    @classmethod
    async def begin(cls, dut, config: Config, size: int, stalls: float = 0.0) -> "Driver":
        driver = cls(dut, config, size, stalls)
        await start(dut)
        return driver

    async def write(self, name: str, value: int):
        done = await self.master.write(self.registers[name].offset, value.to_bytes(4, "little"))
        assert done.resp == AxiResp.OKAY, name

    async def read(self, name: str) -> int:
        done = await self.master.read(self.registers[name].offset, 4)
        assert done.resp == AxiResp.OKAY, name
        return int.from_bytes(done.data, "little")

    async def status(self) -> tuple[int, int, Outcome]:
        view = STATUS.from_bits(await self.read("STATUS"))
        return view.busy, view.done, view.outcome

    async def start(self, run: Run):
        """Load memory and job, and start."""
        self.ram.memory.write(0, run.before)
        for name, value in run.job.items():
            await self.write(name, value)
        await self.write("CONTROL", CONTROL_BITS["start"] | CONTROL_BITS["interrupt"])

    async def interrupt(self, most: int) -> int:
        """The cycles until the interrupt."""
        begin = now()
        while not self.dut.irq.value:
            assert now() - begin < most, "no interrupt"
            await RisingEdge(self.dut.clk)
        return now() - begin

    async def acknowledge(self):
        await self.write("STATUS", DONE)
        assert not self.dut.irq.value

    async def run(self, run: Run, most: int = MOST) -> int:
        """A run whose memory and counters have to be the model's; its cycles."""
        self.ram.reads.clear()
        self.ram.writes.clear()
        await self.start(run)
        cycles = await self.interrupt(most)
        found = self.ram.memory.read(0, len(run.after))  # at once: it is done
        wrong = [k for k, (a, b) in enumerate(zip(found, run.after, strict=True)) if a != b]
        assert not wrong, f"{run.name}: {len(wrong)} bytes differ, first {wrong[0]:x}"
        assert await self.status() == (0, 1, Outcome.COMPLETE)
        await self.acknowledge()
        for name, value in run.counters.items():
            assert await self.read(name) == value, f"{run.name}: {name}"
        return cycles

    async def cut_short(self, run: Run, outcome: Outcome, after: int | None = None):
        """A run that ends with an error, or that is stopped after some cycles."""
        failures, begin = self.ram.failures, now()
        await self.start(run)
        if after is not None:
            for _ in range(after):
                await RisingEdge(self.dut.clk)
            await self.write("CONTROL", CONTROL_BITS["stop"] | CONTROL_BITS["interrupt"])
        while after is None and self.ram.failures == failures:
            assert now() - begin < MOST, "no access to where the memory is at fault"
            await RisingEdge(self.dut.clk)
        await self.interrupt(CUT_SHORT)
        assert await self.status() == (0, 1, outcome)
        quiet = len(self.ram.reads), len(self.ram.writes)
        await self.acknowledge()
        for _ in range(50):  # nothing more goes to the memory
            await RisingEdge(self.dut.clk)
        assert quiet == (len(self.ram.reads), len(self.ram.writes))

    def words_of_bursts(self, run: Run, region: str, *, writes: bool = False) -> float:
        """Mean words of the bursts to a region."""
        first, end = run.regions[region]
        bursts = self.ram.writes if writes else self.ram.reads
        words = [words for _, address, words in bursts if first <= address < end]
        return sum(words) / len(words)
