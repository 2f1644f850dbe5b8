"""Writes the bounds of nodes to memory, and leaves their links alone."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.stream import Slice


class Writer(wiring.Component):
    """Writes nodes in the order in which they come; one a cycle, two cycles to the port.

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
        node = {"node": config.pointer_bits, "bounds": records.bounds(config.fmt)}
        super().__init__({
            "base": In(config.address_bits),
            "i": In(stream.Signature(data.StructLayout(node))),
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
        m.submodules.next = following = Slice(entry)
        # Told a cycle late: with the node that enters, and without the one that leaves.
        room = Signal(init=1)
        m.d.sync += room.eq(waiting.w_level + self.i.valid < self.depth - self.slack)
        entering = Signal(entry)
        m.d.comb += [
            entering.address.eq(self.base + self.i.p.node),
            entering.bounds.eq(self.i.p.bounds),
            waiting.w_data.eq(entering),
            waiting.w_en.eq(self.i.valid),
            self.i.ready.eq(waiting.w_rdy),
            self.room.eq(room),
            following.i.valid.eq(waiting.r_rdy),
            following.i.p.as_value().eq(waiting.r_data),
            waiting.r_en.eq(following.i.ready),
            request.valid.eq(following.o.valid),
            request.p.address.eq(following.o.p.address),
            request.p.write.eq(1),
            request.p.mask.eq((1 << records.bound_bytes(self.config.fmt)) - 1),
            request.p.data.eq(following.o.p.bounds),
            following.o.ready.eq(request.ready),
            self.idle.eq(~waiting.r_rdy & ~following.o.valid),
        ]
        return m
