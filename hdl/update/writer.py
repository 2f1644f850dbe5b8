"""Writes the bounds of nodes to memory, and leaves their links alone."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.isa import NODE_BITS
from hdl.memory.port import Port, PortInterface


class Writer(wiring.Component):
    """Writes nodes in the order in which they come; one a cycle, one cycle to the port.

    Parameters
    ----------
    config : Config
    slack : int
        Nodes that may be on their way when `room` falls.

    Members
    -------
    base : In(address), of node 0; constant while not idle
    i : In(stream of {node: index, bounds})
    port : Out(Port), writes only
    room : Out(1), at least `slack` + 1 nodes more will be taken without a wait
    idle : Out(1), nothing left to write
    """

    i: stream.Interface
    base: Signal
    port: PortInterface
    room: Signal
    idle: Signal

    depth = 16

    def __init__(self, config: Config, slack: int):
        if not 0 <= slack < self.depth:
            raise ValueError(f"slack is 0 to {self.depth - 1}, not {slack}")
        self.config = config
        self.slack = slack
        super().__init__({
            "base": In(config.address_bits),
            "i": In(
                stream.Signature(
                    data.StructLayout({"node": NODE_BITS, "bounds": records.bounds(config.fmt)})
                )
            ),
            "port": Out(Port(config)),
            "room": Out(1),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        request = self.port.request
        entry = data.StructLayout({
            "address": self.config.address_bits,
            "bounds": records.bounds(self.config.fmt),
        })
        m.submodules.waiting = waiting = fifo.SyncFIFO(width=entry.size, depth=self.depth)
        entering = Signal(entry)
        leaving = Signal(entry)
        m.d.comb += [
            entering.address.eq(self.base + self.i.p.node),
            entering.bounds.eq(self.i.p.bounds),
            waiting.w_data.eq(entering),
            waiting.w_en.eq(self.i.valid),
            self.i.ready.eq(waiting.w_rdy),
            self.room.eq(waiting.w_level < self.depth - self.slack),
            leaving.eq(waiting.r_data),
            request.valid.eq(waiting.r_rdy),
            request.p.address.eq(leaving.address),
            request.p.write.eq(1),
            request.p.mask.eq((1 << records.bound_bytes(self.config.fmt)) - 1),
            request.p.data.eq(leaving.bounds),
            waiting.r_en.eq(request.ready),
            self.idle.eq(~waiting.r_rdy),
        ]
        return m
