"""Joins several memory ports into one."""

from amaranth import *
from amaranth.lib import fifo, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import ceil_log2

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.stream import Slice


class Arbiter(wiring.Component):
    """Joins memory ports into one; of those that ask, the one with the lowest index is served.

    A request takes one cycle, and so does a response; one of each a cycle. Requests of one client
    keep their order; between clients the order is that of being served.

    Parameters
    ----------
    config : Config
    clients : int
        Number of ports, at least 1.
    outstanding : int
        Reads that can be under way together, at least 1. With these, all that is asked waits.

    Members
    -------
    clients : In(Port) for each client
    port : Out(Port)
    """

    clients: list[PortInterface]
    port: PortInterface

    def __init__(self, config: Config, clients: int, outstanding: int):
        if clients < 1 or outstanding < 1:
            raise ValueError(f"at least one of each: clients={clients}, outstanding={outstanding}")
        self.count = clients
        self.outstanding = outstanding
        super().__init__({
            "clients": In(Port(config)).array(clients),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.served = served = Slice(self.port.request.p.shape())
        wiring.connect(m, served.o, wiring.flipped(self.port.request))
        request, response = served.i, self.port.response
        # Which client each read under way belongs to; a power of two comes around by itself.
        m.submodules.owners = owners = fifo.SyncFIFO(
            width=max(1, (self.count - 1).bit_length()), depth=1 << ceil_log2(self.outstanding)
        )
        free = Signal(range(self.outstanding + 1), init=self.outstanding)
        room = Signal(init=1)  # free is not 0
        reads = Signal()
        with m.If(reads != response.valid):
            m.d.sync += [
                free.eq(Mux(reads, free - 1, free + 1)),
                room.eq(~reads | (free != 1)),
            ]
        # Whether one can be served does not depend on which, so that both are known early. Where
        # none asks, what is chosen is the last one's.
        *first, last = enumerate(self.clients)
        chosen, owner = Value.cast(last[1].request.p), Const(last[0])
        for index, client in reversed(first):
            chosen = Mux(client.request.valid, Value.cast(client.request.p), chosen)
            owner = Mux(client.request.valid, index, owner)
        asks = Const(0)
        for client in self.clients:
            m.d.comb += client.request.ready.eq(request.ready & room & ~asks)
            asks |= client.request.valid
        m.d.comb += [
            request.valid.eq(asks & room),
            Value.cast(request.p).eq(chosen),
            reads.eq(asks & room & request.ready & ~request.p.write),
            owners.r_en.eq(response.valid),
        ]
        # Written down a cycle later, in which the request is at the port.
        m.d.sync += [owners.w_en.eq(reads), owners.w_data.eq(owner)]

        answer = Signal.like(response.payload, reset_less=True)
        m.d.sync += answer.eq(response.payload)
        for index, client in enumerate(self.clients):
            m.d.sync += client.response.valid.eq(response.valid & (owners.r_data == index))
            m.d.comb += client.response.payload.eq(answer)
        return m
