"""A memory port to an AXI4 master."""

from amaranth import *
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hdl.bus.reader import AxiReader, axi
from hdl.bus.signals import Axi4Interface
from hdl.bus.writer import AxiWriter
from hdl.config import Config
from hdl.memory.port import Port, PortInterface


class AxiMaster(wiring.Component):
    """Serves a memory port over AXI4: INCR bursts of up to 16 words, one ID.

    Requests to addresses that follow one another become bursts: reads as far as they come in
    cycle after cycle or have to wait, writes within some cycles too. One request and one response
    a cycle; a lone read takes 2 cycles more than the bus. Reads do not wait for writes: what was
    written is there for reads once `settled`.

    Parameters
    ----------
    config : Config
    outstanding : int
        Reads that can be under way together. One more waits.

    Members
    -------
    port : In(Port)
    axi : Out(Axi4)
    settled : Out(1), every write that was taken has taken effect
    idle : Out(1), settled, and no read is under way
    flush : In(1), takes no request, and drops the responses that come
    read_failed, write_failed : Out(1), in one cycle for each error that the memory answers with
    """

    port: PortInterface
    axi: Axi4Interface
    settled: Signal
    idle: Signal
    flush: Signal
    read_failed: Signal
    write_failed: Signal

    def __init__(self, config: Config, outstanding: int = 128):
        self.config = config
        self.outstanding = outstanding
        super().__init__({
            "port": In(Port(config)),
            "axi": Out(axi(config)),
            **dict.fromkeys(("settled", "idle", "read_failed", "write_failed"), Out(1)),
            "flush": In(1),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.reader = reader = AxiReader(self.config, self.outstanding)
        m.submodules.writer = writer = AxiWriter(self.config)
        request, response = self.port.request, self.port.response
        asks = request.valid & ~self.flush
        m.d.comb += [
            reader.i.valid.eq(asks & ~request.p.write),
            reader.i.p.eq(request.p.address),
            writer.i.valid.eq(asks & request.p.write),
            writer.i.p.address.eq(request.p.address),
            writer.i.p.mask.eq(request.p.mask),
            writer.i.p.data.eq(request.p.data),
            request.ready.eq(Mux(request.p.write, writer.i.ready, reader.i.ready) & ~self.flush),
            response.valid.eq(reader.o.valid),
            response.p.eq(reader.o.p),
            reader.flush.eq(self.flush),
            self.settled.eq(writer.settled),
            self.idle.eq(reader.idle & writer.settled),
            self.read_failed.eq(reader.failed),
            self.write_failed.eq(writer.failed),
        ]
        # Read and write channels lie in one bus: each side drives its own.
        for name, member in self.axi.signature.members.items():
            side = writer if name[0] in "awb" and name[:2] != "ar" else reader
            outer, inner = getattr(self.axi, name), getattr(side.axi, name)
            m.d.comb += outer.eq(inner) if member.flow == Out else inner.eq(outer)
        return m
