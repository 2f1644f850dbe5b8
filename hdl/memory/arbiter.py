"""Joins several memory ports into one."""

from amaranth import *
from amaranth.lib import fifo, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.stream import Slice


class Arbiter(wiring.Component):
    """Joins memory ports into one; of those that ask, the one with the lowest index is served.

    A request takes one cycle, a response none; one request and one response a cycle. Requests
    of one client keep their order; between clients the order is that of being served.

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
        # Which client each read under way belongs to.
        m.submodules.owners = owners = fifo.SyncFIFO(
            width=max(1, (self.count - 1).bit_length()), depth=self.outstanding
        )

        # Whether one can be served does not depend on which, so that both are known early.
        free = Signal()
        m.d.comb += free.eq(request.ready & owners.w_rdy)
        taken = Const(0)  # an earlier client asks
        for index, client in enumerate(self.clients):
            m.d.comb += client.request.ready.eq(free & ~taken)
            with m.If(client.request.valid & ~taken):
                m.d.comb += [
                    request.valid.eq(owners.w_rdy),
                    request.p.eq(client.request.p),
                    owners.w_en.eq(request.ready & ~client.request.p.write),
                    owners.w_data.eq(index),
                ]
            taken = taken | client.request.valid

            mine = owners.r_rdy & (owners.r_data == index)
            m.d.comb += [
                client.response.valid.eq(response.valid & mine),
                client.response.payload.eq(response.payload),
            ]
            with m.If(mine):
                m.d.comb += response.ready.eq(client.response.ready)
        m.d.comb += owners.r_en.eq(response.valid & response.ready)
        return m
