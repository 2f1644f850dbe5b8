"""The read half of an AXI4 master."""

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.bus.gather import Gather
from hdl.bus.signals import Axi4, Axi4Interface
from hdl.config import Config
from hdl.records import word_bits


class AxiReader(wiring.Component):
    """Reads words in bursts. One address and one word a cycle.

    An address takes 2 cycles to the bus, a word from the bus none.

    Parameters
    ----------
    config : Config
    outstanding : int
        Words that can be under way together, at least 1. One more waits.

    Members
    -------
    i : In(stream of addresses, in words)
    o : Out(stream of words), in the order of the addresses, taken at once
    axi : Out(Axi4), of which only the read channels are used
    flush : In(1), words that come are dropped
    idle : Out(1), no word under way
    failed : Out(1), a word comes with an error
    """

    i: stream.Interface
    o: stream.Interface
    axi: Axi4Interface
    flush: Signal
    idle: Signal
    failed: Signal

    def __init__(self, config: Config, outstanding: int):
        if outstanding < 1:
            raise ValueError(f"at least one read under way, not {outstanding}")
        self.config = config
        self.outstanding = outstanding
        super().__init__({
            "i": In(stream.Signature(config.address_bits)),
            "o": Out(stream.Signature(word_bits(config.fmt), always_ready=True)),
            "axi": Out(axi(config)),
            "flush": In(1),
            "idle": Out(1),
            "failed": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        bus = self.axi
        m.submodules.gather = gather = Gather(self.config, patience=0)
        under_way = Signal(range(self.outstanding + 1))
        room = under_way != self.outstanding
        m.d.comb += [
            gather.i.valid.eq(self.i.valid & room),
            gather.i.p.eq(self.i.p),
            self.i.ready.eq(gather.i.ready & room),
            bus.arvalid.eq(gather.o.valid),
            gather.o.ready.eq(bus.arready),
            *address(self.config, bus, "ar", gather.o.p),
            self.o.valid.eq(bus.rvalid & ~self.flush),
            self.o.p.eq(bus.rdata),
            bus.rready.eq(1),
            self.idle.eq(under_way == 0),
            self.failed.eq(bus.rvalid & Value.cast(bus.rresp)[1]),
        ]
        m.d.sync += under_way.eq(under_way + (self.i.valid & self.i.ready) - bus.rvalid)
        return m


def axi(config: Config) -> Axi4:
    """The bus to the memory of a configuration: a word a beat."""
    bits = word_bits(config.fmt)
    return Axi4(config.address_bits + (bits // 8 - 1).bit_length(), bits)


def address(config: Config, bus, channel: str, burst) -> list:
    """Statements that put a burst on an address channel, but for its handshake."""
    shift = (word_bits(config.fmt) // 8 - 1).bit_length()
    values = {
        "id": 0,
        "addr": burst.address << shift,
        "len": burst.more,
        "size": shift,
        "burst": 1,  # addresses rise
        "cache": 0b0011,  # normal memory, not cached
    }
    return [getattr(bus, f"{channel}{name}").eq(value) for name, value in values.items()]
