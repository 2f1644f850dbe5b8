"""Memory in the block RAM of the device, behind a port."""

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In
from amaranth.utils import ceil_log2

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.records import word_bits


class OnChip(wiring.Component):
    """Words on the chip, zero at first. A response takes 2 cycles; one of each a cycle.

    A memory a byte, each with one read port and one write port that are never used in the same
    cycle: what every tool finds block RAM for. An address beyond them means one in them, or none.

    Parameters
    ----------
    config : Config
    words : int
        Size, 2 to what the configuration addresses.

    Members
    -------
    port : In(Port)
    """

    latency = 2
    port: PortInterface

    def __init__(self, config: Config, *, words: int):
        if not 2 <= words <= 1 << config.address_bits:
            raise ValueError(
                f"2 to {1 << config.address_bits} words have an address, and these are {words}"
            )
        self.config = config
        self.words = words
        super().__init__({"port": In(Port(config))})

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        writing = request.valid & request.p.write
        address = request.p.address[: ceil_log2(self.words)]
        m.d.comb += request.ready.eq(1)
        said = []
        for lane in range(word_bits(self.config.fmt) // 8):
            bytes_ = memory.Memory(shape=8, depth=self.words, init=[])
            m.submodules[f"lane_{lane}"] = bytes_
            reads, writes = bytes_.read_port(), bytes_.write_port()
            said.append(reads.data)
            m.d.comb += [
                reads.addr.eq(address),
                writes.addr.eq(address),
                writes.data.eq(request.p.data.word_select(lane, 8)),
                writes.en.eq(writing & request.p.mask[lane]),
            ]

        read = Signal()  # the memory holds a word that was asked for
        # stage 1: look it up
        m.d.sync += read.eq(request.valid & ~request.p.write)
        # stage 2: give it. Block RAM is slow to answer, so what it says goes no further.
        m.d.sync += [response.valid.eq(read), response.payload.eq(Cat(said))]
        return m
