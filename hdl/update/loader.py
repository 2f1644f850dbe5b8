"""Brings vertices from memory into vertex registers."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.isa import REGISTER_BITS, VERTEX_BITS
from hdl.memory.port import Port, PortInterface
from hdl.stream import Slice


class Loader(wiring.Component):
    """Reads vertices by index, and gives each with the register it is for.

    A load takes two cycles and what the memory takes; one load a cycle. Two loads wait for the
    port before one waits to enter. No more are under way than there are vertex registers: who asks
    sees to it, since a register is loaded again only once it has its vertex.

    Parameters
    ----------
    config : Config

    Members
    -------
    base : In(address), of vertex 0; constant while not idle
    i : In(stream of {v: register, vertex: index})
    o : Out(stream of {v: register, vertex}), taken at once
    port : Out(Port), reads only
    idle : Out(1), no load under way
    """

    i: stream.Interface
    o: stream.Interface
    base: Signal
    port: PortInterface
    idle: Signal

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "base": In(config.address_bits),
            "i": In(
                stream.Signature(data.StructLayout({"v": REGISTER_BITS, "vertex": VERTEX_BITS}))
            ),
            "o": Out(
                stream.Signature(
                    data.StructLayout({
                        "v": REGISTER_BITS,
                        "vertex": records.vertex(config.fmt),
                    }),
                    always_ready=True,
                )
            ),
            "port": Out(Port(config)),
            "idle": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        request, response = self.port.request, self.port.response
        m.submodules.waiting = waiting = Slice(self.config.address_bits)
        m.submodules.registers = registers = fifo.SyncFIFOBuffered(
            width=REGISTER_BITS, depth=self.config.vertex_registers
        )
        entered = self.i.valid & self.i.ready
        m.d.comb += [
            self.i.ready.eq(waiting.i.ready),
            waiting.i.valid.eq(self.i.valid),
            waiting.i.p.eq(self.base + self.i.p.vertex),
            registers.w_en.eq(entered),
            registers.w_data.eq(self.i.p.v),
            request.valid.eq(waiting.o.valid),
            request.p.address.eq(waiting.o.p),
            waiting.o.ready.eq(request.ready),
            registers.r_en.eq(response.valid),
            self.o.valid.eq(response.valid),
            self.o.p.v.eq(registers.r_data),
            self.o.p.vertex.eq(response.payload),
            self.idle.eq(registers.w_level == 0),
        ]
        return m
