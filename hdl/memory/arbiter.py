"""Joins several memory ports into one."""

from amaranth import *
from amaranth.lib import fifo, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface


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
        Reads that can be under way together, at least 1. One more waits.

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

        request, response = self.port.request, self.port.response
        # Which client each read under way belongs to.
        m.submodules.owners = owners = fifo.SyncFIFO(
            width=max(1, (self.count - 1).bit_length()), depth=self.outstanding
        )

        step = Signal()
        m.d.comb += step.eq(~request.valid | request.ready)
        with m.If(step):
            m.d.sync += request.valid.eq(0)

        taken = Const(0)  # an earlier client is served
        for index, client in enumerate(self.clients):
            asks = Signal(name=f"asks_{index}")
            m.d.comb += [
                asks.eq(client.request.valid & (client.request.p.write | owners.w_rdy)),
                client.request.ready.eq(step & asks & ~taken),
            ]
            with m.If(client.request.ready):
                m.d.sync += [request.valid.eq(1), request.p.eq(client.request.p)]
                m.d.comb += [
                    owners.w_en.eq(~client.request.p.write),
                    owners.w_data.eq(index),
                ]
            taken = taken | asks

            mine = owners.r_rdy & (owners.r_data == index)
            m.d.comb += [
                client.response.valid.eq(response.valid & mine),
                client.response.payload.eq(response.payload),
            ]
            with m.If(mine):
                m.d.comb += response.ready.eq(client.response.ready)
        m.d.comb += owners.r_en.eq(response.valid & response.ready)
        return m
