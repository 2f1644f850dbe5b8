"""Memory on the chip, as the simulator takes it."""

from pathlib import Path

from amaranth import *

from hdl.memory.onchip import OnChip
from hdl.records import word_bits

CHIP_MEMORY = Path(__file__).parent / "chip_memory.v"


class ChipMemory(OnChip):
    """Does what OnChip does, in the same cycles, by chip_memory.v, which it instances."""

    def elaborate(self, platform):
        m = Module()
        request, response = self.port.request, self.port.response
        m.d.comb += request.ready.eq(1)
        m.submodules.memory = Instance(
            "chip_memory",
            p_ADDRESS_BITS=self.config.address_bits,
            p_WORD_BITS=word_bits(self.config.fmt),
            p_SIZE=self.words,
            i_clk=ClockSignal(),
            i_rst=ResetSignal(),
            i_request_valid=request.valid,
            **{f"i_request_{k}": request.p[k] for k in ("address", "write", "mask", "data")},
            o_response_valid=response.valid,
            o_response_data=response.payload,
        )
        return m
