"""The update processor: runs an instruction stream, and writes the bounds of every node."""

from itertools import pairwise

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.isa import INSTRUCTION_BITS, REGISTER_BITS
from hdl.memory.arbiter import Arbiter
from hdl.memory.port import Port, PortInterface
from hdl.stream import Slice
from hdl.update.fetch import Fetch, program
from hdl.update.issue import Issue, Stall
from hdl.update.loader import Loader
from hdl.update.merge import Merge2, Merge3
from hdl.update.registers import RegisterFile
from hdl.update.writer import Writer

CYCLES = data.StructLayout(
    {"instructions": 32}
    | {stall.name.lower(): 32 for stall in Stall if stall.value}
    | {"drain": 32}
)
"""Cycles of a run: one an instruction, those of each cause of stall, and those after the last
instruction until the last node is written. Their sum is the length of the run. The cycle in which a
job is handed on counts as one without an instruction to fetch."""

COUNTERS = data.StructLayout({"cycles": CYCLES, "overflow": 1})
"""And whether a vertex that was loaded has an infinite coordinate."""


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
    vertex `config.load_latency` cycles after its load, if the memory answers within
    `config.latency`. A job begins one cycle after it was taken. (Woop, Marmitt, Slusallek 2006,
    update processor.)

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
        m.submodules.arbiter = arbiter = Arbiter(
            config, clients=3, outstanding=fetch.depth + config.vertex_registers
        )
        # Whether an instruction goes is known late in its cycle.
        m.submodules.next = next_instruction = Slice(INSTRUCTION_BITS)
        m.submodules.next_load = next_load = Slice(issue.o_load.payload.shape())
        wiring.connect(m, fetch.o, next_instruction.i)
        wiring.connect(m, next_instruction.o, issue.i)
        wiring.connect(m, issue.o_load, next_load.i)
        wiring.connect(m, next_load.o, loader.i)

        # What does not pass the registers and the merge units goes beside them.
        beside = data.StructLayout({
            "merge3": 1,
            "merge2": 1,
            "b": REGISTER_BITS,
            "axis": issue.o_merge2.p.axis.shape(),
            "node": config.pointer_bits,
        })
        issued = Signal(beside)
        stages = [Signal(beside, name=name) for name in ("reading", "merging", "writing")]
        _, merging, writing = stages
        m.d.comb += [
            issued.merge3.eq(issue.o_merge3.valid),
            issued.merge2.eq(issue.o_merge2.valid),
            issued.b.eq(issue.o_merge3.p.b),  # the same bits in MERGE2
            issued.axis.eq(issue.o_merge2.p.axis),
            issued.node.eq(issue.o_merge2.p.node),
        ]
        m.d.sync += [stage.eq(before) for before, stage in pairwise([issued, *stages])]
        m.submodules.writer = writer = Writer(config, slack=len(stages))

        # Instructions first, since nothing goes on without them and they ask for little. Nodes
        # last, since nothing waits for them but a full writer.
        for client, unit in zip(arbiter.clients, (fetch, loader, writer), strict=True):
            wiring.connect(m, client, unit.port)
        wiring.connect(m, wiring.flipped(self.port), arbiter.port)

        vertex, box = records.vertex(config.fmt), records.box(config.fmt)
        m.submodules.vertices = vertices = RegisterFile(
            vertex, depth=config.vertex_registers, reads=3, forwards=False
        )
        # A merge waits for the box before it: no cycle may be lost there.
        m.submodules.boxes = boxes = RegisterFile(
            box, depth=config.box_registers, reads=2, forwards=True
        )
        m.d.comb += [
            vertices.i.valid.eq(loader.o.valid),
            vertices.i.p.index.eq(loader.o.p.v),
            vertices.i.p.value.eq(loader.o.p.vertex),
            issue.loaded.valid.eq(loader.o.valid),
            issue.loaded.payload.eq(loader.o.p.v),
            issue.room.eq(writer.room),
        ]
        # issue: read the registers
        for reader, v in enumerate(("v0", "v1", "v2")):
            m.d.comb += vertices.indices[reader].eq(issue.o_merge3.p[v])
            m.d.comb += merge3.i.p[v].eq(vertices.values[reader])
        for reader, b in enumerate(("b0", "b1")):
            m.d.comb += boxes.indices[reader].eq(issue.o_merge2.p[b])
            m.d.comb += merge2.i.p[b].eq(boxes.values[reader])
        # two cycles later: merge
        m.d.comb += [
            merge3.i.valid.eq(merging.merge3),
            merge2.i.valid.eq(merging.merge2),
            merge2.i.p.axis.eq(merging.axis),
        ]
        # the cycle after: write
        m.d.comb += [
            boxes.coming.valid.eq(merging.merge3 | merging.merge2),
            boxes.coming.payload.eq(merging.b),
            boxes.i.valid.eq(merge3.o.valid | merge2.o.valid),
            boxes.i.p.index.eq(writing.b),
            boxes.i.p.value.eq(Mux(merge3.o.valid, merge3.o.payload, merge2.o.p.box)),
            merge3.o.ready.eq(1),
            merge2.o.ready.eq(1),  # the writer has room, or it would not have been issued
            writer.i.valid.eq(merge2.o.valid),
            writer.i.p.node.eq(writing.node),
            writer.i.p.bounds.eq(merge2.o.p.bounds),
        ]

        # A job is taken, begins, and ends when nothing is under way.
        job, begins = Signal.like(self.i.p, reset_less=True), Signal()
        m.d.comb += [
            self.i.ready.eq(~self.busy),
            fetch.i.valid.eq(begins),
            fetch.i.payload.eq(job.program),
            issue.start.eq(begins),
            loader.base.eq(job.vertices),
            writer.base.eq(job.nodes),
        ]
        m.d.sync += begins.eq(self.i.valid & ~self.busy)
        issued_all = fetch.idle & ~begins & ~next_instruction.o.valid & issue.idle
        merges = Cat(Cat(stage.merge3, stage.merge2) for stage in stages).any()
        idle = issued_all & ~next_load.o.valid & loader.idle & ~merges & writer.idle
        with m.If(~self.busy):
            m.d.sync += [job.eq(self.i.p), self.busy.eq(self.i.valid)]
        with m.Elif(idle & ~self.port.request.valid):
            m.d.sync += self.busy.eq(0)

        # What a cycle was is known late in it, and counted in the next. So the last one is not
        # counted when it comes, but with the first: there is nothing left to issue in it.
        first_was, was = Signal(), Signal(range(len(CYCLES.members)))
        m.d.sync += [
            first_was.eq(begins),
            was.eq(Mux(issued_all, len(Stall), Value.cast(issue.stall))),
        ]
        with m.If(first_was):
            m.d.sync += [
                self.counters.eq(0),
                self.counters.cycles.fetch.eq(1),
                self.counters.cycles.drain.eq(1),
            ]
        with m.Elif(self.busy), m.Switch(was):
            for index, name in enumerate(CYCLES.members):
                with m.Case(index):
                    m.d.sync += self.counters.cycles[name].eq(self.counters.cycles[name] + 1)

        infinite = Signal()
        loaded = loader.o.p.vertex
        m.d.sync += infinite.eq(loader.o.valid & Cat(loaded[a].exp.all() for a in "xyz").any())
        with m.If(infinite):
            m.d.sync += self.counters.overflow.eq(1)
        return m
