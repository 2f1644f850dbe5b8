"""The update processor: runs an instruction stream, and writes the bounds of every node."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.memory.arbiter import Arbiter
from hdl.memory.port import Port, PortInterface
from hdl.update.fetch import Fetch, program
from hdl.update.issue import Issue, Stall
from hdl.update.loader import Loader
from hdl.update.merge import Merge2, Merge3
from hdl.update.registers import RegisterFile
from hdl.update.writer import Writer

COUNTERS = data.StructLayout(
    {"instructions": 32}
    | {stall.name.lower(): 32 for stall in Stall if stall.value}
    | {"drain": 32}
)
"""Cycles of a run: one an instruction, those of each cause of stall, and those after the last
instruction until the last node is written. Their sum is the length of the run."""


def job(config: Config) -> data.StructLayout:
    """An update: a program, and where vertices and nodes lie in memory."""
    return data.StructLayout({
        "program": program(config),
        "vertices": config.address_bits,
        "nodes": config.address_bits,
    })


class UpdateProcessor(wiring.Component):
    """Runs one program a job: reads vertices, writes the bounds of nodes.

    One instruction a cycle, in order, at any timing of the memory: an instruction waits until
    its operands are there. A box can be merged again `config.box_latency` cycles after its merge, a
    vertex once the memory has answered. (Woop, Marmitt, Slusallek 2006, update processor.)

    ::

        fetch ─► issue ─► loader ─► vertex registers ─► merge 3 ─┐
                   └────────────────► box registers ──► merge 2 ─┴─► box registers
                                                           └─► writer

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of job), taken while not busy
    busy : Out(1); falls when all nodes of the job are in memory
    counters : Out(COUNTERS), of the last job
    port : Out(Port)
    """

    i: stream.Interface
    busy: Signal
    counters: data.View
    port: PortInterface

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "i": In(stream.Signature(job(config))),
            "busy": Out(1),
            "counters": Out(COUNTERS),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()
        config = self.config

        m.submodules.fetch = fetch = Fetch(config)
        m.submodules.issue = issue = Issue(config)
        m.submodules.loader = loader = Loader(config)
        m.submodules.merge3 = merge3 = Merge3(config.fmt)
        m.submodules.merge2 = merge2 = Merge2(config.fmt)
        m.submodules.writer = writer = Writer(config, slack=config.box_latency - 1)
        m.submodules.arbiter = arbiter = Arbiter(
            config, clients=3, outstanding=fetch.depth + config.vertex_registers
        )
        wiring.connect(m, fetch.o, issue.i)
        wiring.connect(m, issue.o_load, loader.i)
        # Instructions first, since nothing goes on without them and they ask for little. Nodes
        # last, since nothing waits for them but a full writer.
        for client, unit in zip(arbiter.clients, (fetch, loader, writer), strict=True):
            wiring.connect(m, client, unit.port)
        wiring.connect(m, wiring.flipped(self.port), arbiter.port)

        vertex, box = records.vertex(config.fmt), records.box(config.fmt)
        m.submodules.vertices = vertices = RegisterFile(
            vertex, depth=config.vertex_registers, reads=3
        )
        m.submodules.boxes = boxes = RegisterFile(box, depth=config.box_registers, reads=2)
        m.d.comb += [
            vertices.i.valid.eq(loader.o.valid),
            vertices.i.p.index.eq(loader.o.p.v),
            vertices.i.p.value.eq(loader.o.p.vertex),
            issue.loaded.valid.eq(loader.o.valid),
            issue.loaded.payload.eq(loader.o.p.v),
            issue.room.eq(writer.room),
        ]
        # issue: read the registers
        for read, v in enumerate(("v0", "v1", "v2")):
            m.d.comb += vertices.indices[read].eq(issue.o_merge3.p[v])
            m.d.comb += merge3.i.p[v].eq(vertices.values[read])
        for read, b in enumerate(("b0", "b1")):
            m.d.comb += boxes.indices[read].eq(issue.o_merge2.p[b])
            m.d.comb += merge2.i.p[b].eq(boxes.values[read])
        m.d.sync += [
            merge3.i.valid.eq(issue.o_merge3.valid),
            merge2.i.valid.eq(issue.o_merge2.valid),
            merge2.i.p.axis.eq(issue.o_merge2.p.axis),
        ]
        # next cycle: merge. What does not pass the merge units goes beside them.
        merge_b = Signal.like(issue.o_merge3.p.b)
        merge_node = Signal.like(issue.o_merge2.p.node)
        write_b = Signal.like(merge_b)
        m.d.sync += [
            merge_b.eq(issue.o_merge3.p.b),  # the same bits in MERGE2
            merge_node.eq(issue.o_merge2.p.node),
            write_b.eq(merge_b),
            writer.i.p.node.eq(merge_node),
        ]
        # the cycle after: write
        m.d.comb += [
            boxes.i.valid.eq(merge3.o.valid | merge2.o.valid),
            boxes.i.p.index.eq(write_b),
            boxes.i.p.value.eq(Mux(merge3.o.valid, merge3.o.payload, merge2.o.p.box)),
            merge3.o.ready.eq(1),
            merge2.o.ready.eq(1),  # the writer has room, or it would not have been issued
            writer.i.valid.eq(merge2.o.valid),
            writer.i.p.bounds.eq(merge2.o.p.bounds),
        ]

        # A job begins, and ends when nothing is under way.
        begin = self.i.valid & self.i.ready
        m.d.comb += [
            self.i.ready.eq(~self.busy),
            fetch.i.valid.eq(begin),
            fetch.i.payload.eq(self.i.p.program),
            issue.start.eq(begin),
        ]
        merging = Cat(merge3.i.valid, merge3.o.valid, merge2.i.valid, merge2.o.valid).any()
        writing = ~writer.idle | self.port.request.valid
        with m.If(begin):
            m.d.sync += [
                self.busy.eq(1),
                loader.base.eq(self.i.p.vertices),
                writer.base.eq(self.i.p.nodes),
                self.counters.eq(0),
            ]
        with m.Elif(self.busy):
            with m.If(fetch.idle & loader.idle & ~merging & ~writing):
                m.d.sync += self.busy.eq(0)
            self._count(m, fetch, issue)
        return m

    def _count(self, m, fetch, issue):
        def count(name):
            m.d.sync += self.counters[name].eq(self.counters[name] + 1)

        with m.If(fetch.idle):
            count("drain")
        with m.Else(), m.Switch(issue.stall):
            for stall in Stall:
                with m.Case(stall):
                    count(stall.name.lower() if stall.value else "instructions")
