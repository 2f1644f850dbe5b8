"""AXI4-Lite to registers."""

from amaranth import *
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from hdl.bus.signals import (
    LITE_BITS,
    AxiLite,
    AxiLiteInterface,
    Registers,
    RegistersInterface,
    Response,
)

BYTE_BITS = (LITE_BITS // 8 - 1).bit_length()


class Step(enum.Enum, shape=2):
    """Of a transfer."""

    WAIT = 0
    READ = 1
    WRITE = 2
    ANSWER = 3


class AxiLiteSlave(wiring.Component):
    """Serves AXI4-Lite from registers: one transfer at a time, in 3 cycles and its handshakes.

    Reads and writes take turns where both wait. Where there is no register, and for a write of
    less than all four bytes, which does nothing, the answer is SLVERR.

    Parameters
    ----------
    address_bits : int
        Of a byte. The lowest two do not count.

    Members
    -------
    axi : In(AxiLite)
    registers : Out(Registers)
    """

    axi: AxiLiteInterface
    registers: RegistersInterface

    def __init__(self, address_bits: int):
        if address_bits <= BYTE_BITS:
            raise ValueError(f"an address has at least {BYTE_BITS + 1} bits, not {address_bits}")
        super().__init__({
            "axi": In(AxiLite(address_bits)),
            "registers": Out(Registers(address_bits - BYTE_BITS)),
        })

    def elaborate(self, platform):
        m = Module()

        axi, registers = self.axi, self.registers
        # Each channel is taken for itself, and waits here for the others.
        full = {name: Signal(name=f"{name}_full") for name in ("ar", "aw", "w")}
        read_at = Signal.like(registers.address, reset_less=True)
        write_at = Signal.like(registers.address, reset_less=True)
        word = Signal(LITE_BITS, reset_less=True)
        bytes_of_word = Signal.like(axi.wstrb, reset_less=True)
        for channel, took in [
            ("ar", [read_at.eq(axi.araddr[BYTE_BITS:])]),
            ("aw", [write_at.eq(axi.awaddr[BYTE_BITS:])]),
            ("w", [word.eq(axi.wdata), bytes_of_word.eq(axi.wstrb)]),
        ]:
            m.d.comb += getattr(axi, f"{channel}ready").eq(~full[channel])
            with m.If(getattr(axi, f"{channel}valid") & ~full[channel]):
                m.d.sync += [full[channel].eq(1), *took]

        step = Signal(Step)
        wrote = Signal()  # by the transfer before
        reads = Signal()
        writes = Signal()
        whole = Signal()
        m.d.comb += [
            reads.eq(full["ar"] & (wrote | ~(full["aw"] & full["w"]))),
            writes.eq(full["aw"] & full["w"] & ~reads),
            whole.eq(bytes_of_word.all()),
            registers.address.eq(Mux(reads, read_at, write_at)),
            registers.write_data.eq(word),
            registers.write.eq((step == Step.WAIT) & writes & whole),
        ]
        with m.Switch(step):
            with m.Case(Step.WAIT):
                with m.If(reads):
                    m.d.sync += [step.eq(Step.READ), wrote.eq(0)]
                with m.Elif(writes):
                    m.d.sync += [step.eq(Step.WRITE), wrote.eq(1)]
            with m.Case(Step.READ):
                m.d.sync += [
                    step.eq(Step.ANSWER),
                    axi.rvalid.eq(1),
                    axi.rdata.eq(registers.read_data),
                    axi.rresp.eq(Mux(registers.missing, Response.SLVERR, Response.OKAY)),
                    full["ar"].eq(0),
                ]
            with m.Case(Step.WRITE):
                bad = registers.missing | ~whole
                m.d.sync += [
                    step.eq(Step.ANSWER),
                    axi.bvalid.eq(1),
                    axi.bresp.eq(Mux(bad, Response.SLVERR, Response.OKAY)),
                    full["aw"].eq(0),
                    full["w"].eq(0),
                ]
            with m.Case(Step.ANSWER):
                with m.If((axi.rvalid & axi.rready) | (axi.bvalid & axi.bready)):
                    m.d.sync += [step.eq(Step.WAIT), axi.rvalid.eq(0), axi.bvalid.eq(0)]
        return m
