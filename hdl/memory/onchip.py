"""Memory in the block RAM of the device, behind a port."""

from collections.abc import Sequence

from amaranth import *
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In
from amaranth.utils import ceil_log2

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.records import word_bits


class OnChip(wiring.Component):
    """Words on the chip. A response takes 2 cycles; one request and one response a cycle.

    A memory a byte, each with one read port and one write port that are never used in the same
    cycle: what every tool finds block RAM for. An address beyond them means one in them, or none.

    Parameters
    ----------
    config : Config
    words : int
        Size, 2 to what the configuration addresses.
    init : sequence of int
        Words from address 0 on, as the device is configured; zero where there are none.

    Members
    -------
    port : In(Port)
    """

    latency = 2
    port: PortInterface

    def __init__(self, config: Config, *, words: int, init: Sequence[int] = ()):
        if not 2 <= words <= 1 << config.address_bits:
            raise ValueError(
                f"2 to {1 << config.address_bits} words have an address, and these are {words}"
            )
        if len(init) > words:
            raise ValueError(f"{len(init)} words do not go into {words}")
        self.config = config
        self.words = words
        self.init = init
        super().__init__({"port": In(Port(config))})

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        writing = request.valid & request.p.write
        address = request.p.address[: ceil_log2(self.words)]
        m.d.comb += request.ready.eq(1)
        said = []
        for lane in range(word_bits(self.config.fmt) // 8):
            init = [word >> 8 * lane & 0xFF for word in self.init]
            m.submodules[f"lane_{lane}"] = bytes_ = memory.Memory(
                shape=8, depth=self.words, init=init
            )
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
