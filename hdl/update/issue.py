"""Decodes instructions and lets each go when its operands are there."""

from amaranth import *
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.isa import INSTRUCTION_BITS, LAYOUTS, REGISTER_BITS, Opcode
from hdl.update.interlock import Interlock


class Stall(enum.Enum, shape=3):
    """Why no instruction went in a cycle."""

    NONE = 0
    FETCH = 1  # the next instruction is not there
    VERTEX = 2  # MERGE3 or LOAD waits for a vertex that is being loaded
    BOX = 3  # MERGE2 waits for a box that is being merged
    LOAD = 4  # LOAD waits for the memory port
    WRITE = 5  # MERGE2 waits for the memory port to take earlier nodes


MERGE3 = data.StructLayout({f: REGISTER_BITS for f in ("b", "v0", "v1", "v2")})


def merge2(config: Config) -> data.StructLayout:
    """MERGE2, and the node that it writes."""
    registers = dict.fromkeys(("b", "b0", "b1"), REGISTER_BITS)
    return data.StructLayout({**registers, "axis": 2, "node": config.pointer_bits})


class Issue(wiring.Component):
    """Issues instructions in order, one a cycle, to the loader and the merge units.

    An instruction is looked at in the cycle in which it comes, and goes in the next, or waits. A
    vertex register can be read one cycle after `loaded`, a box register `config.box_latency` cycles
    after the issue of the merge that writes it.

    Parameters
    ----------
    config : Config

    Members
    -------
    start : In(1), the next MERGE2 writes node 0
    i : In(stream of instructions)
    o_load : Out(stream of {v, vertex})
    o_merge3 : Out(stream of {b, v0, v1, v2}), taken at once
    o_merge2 : Out(stream of {b, b0, b1, axis, node}), taken at once
    loaded : In(stream of registers), taken at once
    room : In(1), a node can be written
    idle : Out(1), no instruction is here
    stall : Out(Stall), of this cycle
    """

    i: stream.Interface
    o_load: stream.Interface
    o_merge3: stream.Interface
    o_merge2: stream.Interface
    loaded: stream.Interface
    start: Signal
    room: Signal
    idle: Signal
    stall: Signal

    def __init__(self, config: Config):
        self.config = config
        load = LAYOUTS[Opcode.LOAD]
        super().__init__({
            "start": In(1),
            "i": In(stream.Signature(INSTRUCTION_BITS)),
            "o_load": Out(
                stream.Signature(data.StructLayout({f: load[f].shape for f in ("v", "vertex")}))
            ),
            "o_merge3": Out(stream.Signature(MERGE3, always_ready=True)),
            "o_merge2": Out(stream.Signature(merge2(config), always_ready=True)),
            "loaded": In(stream.Signature(REGISTER_BITS, always_ready=True)),
            "room": In(1),
            "idle": Out(1),
            "stall": Out(Stall),
        })

    def elaborate(self, platform):
        m = Module()

        # The instruction that goes or waits.
        word, valid, goes = Signal(INSTRUCTION_BITS, reset_less=True), Signal(), Signal()
        step = Signal()
        m.d.comb += [step.eq(~valid | goes), self.i.ready.eq(step), self.idle.eq(~valid)]
        with m.If(step):
            m.d.sync += [word.eq(self.i.payload), valid.eq(self.i.valid)]
        load, merge3, merge2, set_node = (
            data.View(LAYOUTS[op], word[: LAYOUTS[op].size]) for op in Opcode
        )
        node = Signal(self.config.pointer_bits)
        m.d.comb += [
            self.o_load.p.v.eq(load.v),
            self.o_load.p.vertex.eq(load.vertex),
            self.o_merge2.p.node.eq(node),
            *(self.o_merge3.p[field].eq(merge3[field]) for field in ("b", "v0", "v1", "v2")),
            *(self.o_merge2.p[field].eq(merge2[field]) for field in ("b", "b0", "b1", "axis")),
        ]

        m.submodules.interlock = interlock = Interlock(self.config)
        m.d.comb += [
            interlock.next.eq(self.i.payload),
            interlock.here.eq(word),
            interlock.valid.eq(valid),
            interlock.step.eq(step),
            interlock.loaded.valid.eq(self.loaded.valid),
            interlock.loaded.payload.eq(self.loaded.payload),
        ]

        with m.If(~valid):
            m.d.comb += self.stall.eq(Stall.FETCH)
        with m.Else(), m.Switch(load.opcode):
            with m.Case(Opcode.LOAD):
                with m.If(interlock.load):
                    m.d.comb += self.stall.eq(Stall.VERTEX)
                with m.Else():
                    m.d.comb += [self.o_load.valid.eq(1), goes.eq(self.o_load.ready)]
                    with m.If(~self.o_load.ready):
                        m.d.comb += self.stall.eq(Stall.LOAD)
            with m.Case(Opcode.MERGE3):
                with m.If(interlock.merge3):
                    m.d.comb += self.stall.eq(Stall.VERTEX)
                with m.Else():
                    m.d.comb += [self.o_merge3.valid.eq(1), goes.eq(1)]
            with m.Case(Opcode.MERGE2):
                with m.If(interlock.merge2):
                    m.d.comb += self.stall.eq(Stall.BOX)
                with m.Elif(~self.room):
                    m.d.comb += self.stall.eq(Stall.WRITE)
                with m.Else():
                    m.d.comb += [self.o_merge2.valid.eq(1), goes.eq(1)]
                    m.d.sync += node.eq(node + 1)
            with m.Case(Opcode.NODE):
                m.d.comb += goes.eq(1)
                m.d.sync += node.eq(set_node.node)
        with m.If(self.start):
            m.d.sync += node.eq(0)
        return m
