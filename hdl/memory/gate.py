"""A memory port that can be shut while the memory is in use by others."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface


class Gate(wiring.Component):
    """Passes a port on. Shut, it takes no request, and drops the responses that still come.

    So a unit can be reset in the middle of its reads: once shut and `idle`, nothing of what it
    asked for is under way. Takes no cycles; a request that waits is withdrawn as it shuts, so what
    follows is an Arbiter, which does not mind.

    Parameters
    ----------
    config : Config
    outstanding : int
        Reads that can be under way together, at least 1. One more waits.

    Members
    -------
    client : In(Port)
    port : Out(Port)
    shut : In(1)
    idle : Out(1), no read is under way
    """

    client: PortInterface
    port: PortInterface
    shut: Signal
    idle: Signal

    def __init__(self, config: Config, outstanding: int):
        if outstanding < 1:
            raise ValueError(f"at least one read under way, not {outstanding}")
        self.outstanding = outstanding
        super().__init__({
            "client": In(Port(config)),
            "port": Out(Port(config)),
            "shut": In(1),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        asked, asks = self.client.request, self.port.request
        under_way = Signal(range(self.outstanding + 1))
        after, opens = Signal.like(under_way), Signal()
        full = Signal()
        m.d.comb += [
            opens.eq(~self.shut & ~full),
            asks.valid.eq(asked.valid & opens),
            asks.p.eq(asked.p),
            asked.ready.eq(asks.ready & opens),
            after.eq(
                under_way + (asks.valid & asks.ready & ~asks.p.write) - self.port.response.valid
            ),
            self.client.response.valid.eq(self.port.response.valid & ~self.shut),
            self.client.response.payload.eq(self.port.response.payload),
        ]
        m.d.sync += [
            under_way.eq(after),
            self.idle.eq(after == 0),
            full.eq(after == self.outstanding),
        ]
        return m
