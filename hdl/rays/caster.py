"""The ray caster: rays from memory, through an updated tree, to hits in memory."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.isa import NODE_BITS
from hdl.memory.arbiter import Arbiter
from hdl.memory.cache import Cache
from hdl.memory.port import Port, PortInterface
from hdl.rays.recorder import Recorder
from hdl.rays.setup import Setup
from hdl.rays.source import Source, rays
from hdl.rays.tester import Tester
from hdl.rays.traversal import Traversal

COUNTERS = data.StructLayout(
    dict.fromkeys(
        (
            *("cycles", "packets", "steps", "tests", "ray_tests", "pushes", "pops"),
            *("node_hits", "node_misses", "geometry_hits", "geometry_misses"),
        ),
        32,
    )
)
"""Of a run: its cycles, what traversal and triangle tests did, and what the caches held."""


def cast_job(config: Config) -> data.StructLayout:
    """Rays, the scene that they meet, and where their hits go, a word a ray in their order."""
    address = config.address_bits
    return data.StructLayout({
        "rays": rays(config),
        "root": NODE_BITS,
        **dict.fromkeys(("nodes", "triangles", "vertices", "hits"), address),
    })


class RayCaster(wiring.Component):
    """Finds the first hit of each ray of a job. What it reads must not change meanwhile.

    ::

        source ─► setup ─► traversal ◄─► node cache
                    │        ▲ │ ▲
                    └─► tester ◄─┘ ◄──► geometry cache
                          └─► recorder

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of cast_job), taken while not busy
    busy : Out(1); falls when all hits are in memory
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
            "i": In(stream.Signature(cast_job(config))),
            "busy": Out(1),
            "counters": Out(COUNTERS),
            "port": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()
        config = self.config

        m.submodules.source = source = Source(config)
        m.submodules.setup = setup = Setup(config)
        m.submodules.traversal = traversal = Traversal(config)
        m.submodules.tester = tester = Tester(config)
        wiring.connect(m, source.o, setup.i)
        wiring.connect(m, setup.o_rays, tester.i_rays)
        wiring.connect(m, setup.o_starts, traversal.i_start)
        wiring.connect(m, traversal.o_tests, tester.i_tests)
        wiring.connect(m, tester.o_tests, traversal.i_tests)
        wiring.connect(m, traversal.o_done, tester.i_done)
        m.d.comb += [
            traversal.i_setup.valid.eq(setup.o_slabs.valid),
            traversal.i_setup.payload.eq(setup.o_slabs.payload),
            setup.o_slabs.ready.eq(1),
        ]

        # Nodes and geometry come through caches, in any order.
        job = Signal.like(self.i.p, reset_less=True)
        tag_bits = len(tester.o_reads.p.tag.as_value())
        m.submodules.node_cache = node_cache = Cache(
            config, words=config.cache_words, tags=config.packets, misses=config.packets
        )
        m.submodules.geometry_cache = geometry_cache = Cache(
            config, words=config.cache_words, tags=1 << tag_bits, misses=config.packets
        )
        m.d.comb += [
            node_cache.reads.request.valid.eq(traversal.o_nodes.valid),
            node_cache.reads.request.p.tag.eq(traversal.o_nodes.p.packet),
            node_cache.reads.request.p.address.eq(job.nodes + traversal.o_nodes.p.node),
            traversal.o_nodes.ready.eq(node_cache.reads.request.ready),
            traversal.i_nodes.valid.eq(node_cache.reads.response.valid),
            traversal.i_nodes.p.packet.eq(node_cache.reads.response.p.tag),
            traversal.i_nodes.p.word.as_value().eq(node_cache.reads.response.p.word),
            node_cache.reads.response.ready.eq(1),
            geometry_cache.reads.request.valid.eq(tester.o_reads.valid),
            geometry_cache.reads.request.p.tag.eq(tester.o_reads.p.tag.as_value()),
            geometry_cache.reads.request.p.address.eq(tester.o_reads.p.address),
            tester.o_reads.ready.eq(geometry_cache.reads.request.ready),
            tester.i_words.valid.eq(geometry_cache.reads.response.valid),
            tester.i_words.p.tag.as_value().eq(geometry_cache.reads.response.p.tag),
            tester.i_words.p.word.eq(geometry_cache.reads.response.p.word),
            geometry_cache.reads.response.ready.eq(1),
            traversal.root.eq(job.root),
            tester.triangles.eq(job.triangles),
            tester.vertices.eq(job.vertices),
        ]

        m.submodules.recorder = recorder = Recorder(config)
        wiring.connect(m, tester.o_hits, recorder.i)
        wiring.connect(m, recorder.o_free, source.i_free)
        m.d.comb += [
            recorder.base.eq(job.hits),
            recorder.i_begun.valid.eq(source.o_begun.valid),
            recorder.i_begun.payload.eq(source.o_begun.payload),
            source.o_begun.ready.eq(1),
        ]
        m.submodules.arbiter = arbiter = Arbiter(
            config, clients=4, outstanding=2 * config.packets + source.depth
        )
        # Nodes first: each packet waits for one. Rays last: they are asked for early.
        wiring.connect(m, arbiter.clients[0], node_cache.port)
        wiring.connect(m, arbiter.clients[1], geometry_cache.port)
        wiring.connect(m, arbiter.clients[2], recorder.port)
        wiring.connect(m, arbiter.clients[3], source.port)
        wiring.connect(m, wiring.flipped(self.port), arbiter.port)

        # A job begins, and ends when each packet that began has been written.
        begin = self.i.valid & self.i.ready
        written = Signal(config.address_bits)
        m.d.comb += [
            self.i.ready.eq(~self.busy & source.i.ready),
            source.i.valid.eq(begin),
            source.i.payload.eq(self.i.p.rays),
            *(unit.clear.eq(begin) for unit in (node_cache, geometry_cache, traversal, tester)),
        ]
        with m.If(recorder.o_free.valid):
            m.d.sync += written.eq(written + 1)
        with m.If(begin):
            m.d.sync += [self.busy.eq(1), job.eq(self.i.p), written.eq(0)]
        with m.Elif((written == job.rays.packets) & ~self.port.request.valid):
            m.d.sync += self.busy.eq(0)
        cycles = Signal(32)
        m.d.sync += cycles.eq(Mux(begin, 0, cycles + self.busy))
        m.d.comb += [
            self.counters.cycles.eq(cycles),
            self.counters.packets.eq(written),
            self.counters.steps.eq(traversal.counters.steps),
            self.counters.pushes.eq(traversal.counters.pushes),
            self.counters.pops.eq(traversal.counters.pops),
            self.counters.tests.eq(tester.counters.tests),
            self.counters.ray_tests.eq(tester.counters.ray_tests),
            self.counters.node_hits.eq(node_cache.hits),
            self.counters.node_misses.eq(node_cache.misses),
            self.counters.geometry_hits.eq(geometry_cache.hits),
            self.counters.geometry_misses.eq(geometry_cache.misses),
        ]
        return m
