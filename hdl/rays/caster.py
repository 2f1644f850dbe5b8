"""The ray caster: rays of a camera or from memory, through a tree, to hits in memory."""

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.memory.port import Port, PortInterface, Reads, ReadsInterface
from hdl.rays import census
from hdl.rays.camera import Camera, image
from hdl.rays.census import Census
from hdl.rays.corners import tag
from hdl.rays.numbers import Numbers
from hdl.rays.recorder import Recorder
from hdl.rays.setup import Setup
from hdl.rays.source import Source, rays
from hdl.rays.tester import Tester
from hdl.rays.transform import Transform
from hdl.rays.traversal import Traversal
from hdl.stream import Slice

COUNTERS = data.StructLayout({
    **dict.fromkeys(("packets", "steps", "tests", "ray_tests", "pushes", "pops"), 32),
    "waits": census.COUNTERS,
})
"""Of a run: packets whose hits are in memory; packets at nodes, each a cycle; packets at leaves and
rays of those at triangles; entries put on stacks, and taken off; cycles without a packet at a node.
The steps and the waits are the length of the run."""


def overflows(config: Config) -> data.StructLayout:
    """Where finite numbers have become infinite in a run.

    In the rays of the camera, if there is one; in what is known of a ray before it meets a node;
    at a plane; at a triangle; or on the way into an object, if there are instances.
    """
    camera = ("camera",) if config.camera else ()
    transform = ("transform",) if config.instances else ()
    places = (*camera, "setup", "planes", "triangles", *transform)
    return data.StructLayout(dict.fromkeys(places, 1))


def cast_job(config: Config) -> data.StructLayout:
    """Rays, the scene that they meet, and where their hits go.

    Hits are a word a ray, in the order of the rays: that in memory, or that of the packets of the
    image (rows of 2 x 2 pixels, each in the order of rows) where `camera` is set. A machine has
    the fields of what gives it rays, and `camera` if that is both.
    """
    return data.StructLayout({
        "scene": records.scene(config),
        **({"camera": 1} if config.camera and config.source else {}),
        **({"image": image(config)} if config.camera else {}),
        **({"rays": rays(config)} if config.source else {}),
        "hits": config.address_bits,
    })


class RayCaster(wiring.Component):
    """Finds the first hit of each ray of a job. What it reads must not change meanwhile.

    ::

        camera or source ─► setup ─► traversal ◄─► nodes
                              │        ▲ │ ▲
                              └─► tester ◄─┘ ◄──► geometry
                                    └─► recorder

    With instances packets come from the tester to setup again, by way of `transform`.

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of cast_job), taken when all hits have been written
    counters : Out(COUNTERS), of the last job
    overflows : Out(overflows), likewise
    entries : Out(32), packets that entered an object, likewise; where there are instances
    nodes, geometry : Out(Reads), of nodes, and of triangles with their vertices
    rays : Out(Port), reads only; where rays come from memory
    hits : Out(Port), writes only
    """

    i: stream.Interface
    counters: data.View
    overflows: data.View
    entries: Signal
    nodes: ReadsInterface
    geometry: ReadsInterface
    rays: PortInterface
    hits: PortInterface

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            "i": In(stream.Signature(cast_job(config))),
            "counters": Out(COUNTERS),
            "overflows": Out(overflows(config)),
            **({"entries": Out(32)} if config.instances else {}),
            "nodes": Out(Reads(config, config.packets)),
            "geometry": Out(Reads(config, 1 << tag(config).size)),
            **({"rays": Out(Port(config))} if config.source else {}),
            "hits": Out(Port(config)),
        })

    def elaborate(self, platform):
        m = Module()
        config = self.config

        job = self.i.p
        givers: list[Camera | Source] = []
        infinite = {}
        if config.camera:
            m.submodules.camera = camera = Camera(config)
            m.d.comb += camera.i.p.eq(job.image)
            givers.append(camera)
            infinite["camera"] = camera.overflow
        if config.source:
            m.submodules.source = source = Source(config)
            m.d.comb += source.i.p.eq(job.rays)
            wiring.connect(m, wiring.flipped(self.rays), source.port)
            givers.append(source)
        m.submodules.numbers = numbers = Numbers(config)
        m.submodules.setup = setup = Setup(config)
        m.submodules.traversal = traversal = Traversal(config)
        m.submodules.tester = tester = Tester(config)
        m.submodules.recorder = recorder = Recorder(config)
        m.submodules.next_number = next_number = Slice(numbers.o.payload.shape())
        wiring.connect(m, numbers.o, next_number.i)
        wiring.connect(m, next_number.o, setup.i_packets)
        wiring.connect(m, setup.o_slabs, traversal.i_setup)
        wiring.connect(m, setup.o_rays, tester.i_rays)
        wiring.connect(m, setup.o_starts, traversal.i_start)
        wiring.connect(m, traversal.o_tests, tester.i_tests)
        wiring.connect(m, tester.o_tests, traversal.i_tests)
        wiring.connect(m, traversal.o_done, tester.i_done)
        wiring.connect(m, tester.o_hits, recorder.i)
        wiring.connect(m, recorder.o_free, numbers.i)

        # Rays come from one of them.
        giving = Signal()
        chosen = [job.camera, ~job.camera] if len(givers) == 2 else [Const(1)]
        for giver, wanted in zip(givers, chosen, strict=True):
            m.d.comb += [
                giver.i.valid.eq(giving & wanted),
                giver.o.ready.eq(setup.i.ready),
            ]
        first, last = givers[0], givers[-1]
        m.d.comb += [
            setup.i.valid.eq(first.o.valid | last.o.valid),
            setup.i.p.eq(Mux(chosen[0], first.o.p, last.o.p)),
            recorder.i_begun.valid.eq(next_number.o.valid & next_number.o.ready),
            recorder.i_begun.p.eq(next_number.o.p),
            recorder.base.eq(job.hits),
        ]

        # Nodes and geometry come in any order, each with the tag that it was asked with.
        m.d.comb += [
            self.nodes.request.valid.eq(traversal.o_nodes.valid),
            self.nodes.request.p.tag.eq(traversal.o_nodes.p.packet),
            self.nodes.request.p.address.eq(job.scene.nodes + traversal.o_nodes.p.node),
            traversal.o_nodes.ready.eq(self.nodes.request.ready),
            traversal.i_nodes.valid.eq(self.nodes.response.valid),
            traversal.i_nodes.p.packet.eq(self.nodes.response.p.tag),
            traversal.i_nodes.p.word.as_value().eq(self.nodes.response.p.word),
            self.geometry.request.valid.eq(tester.o_reads.valid),
            self.geometry.request.p.tag.eq(tester.o_reads.p.tag.as_value()),
            self.geometry.request.p.address.eq(tester.o_reads.p.address),
            tester.o_reads.ready.eq(self.geometry.request.ready),
            tester.i_words.valid.eq(self.geometry.response.valid),
            tester.i_words.p.tag.as_value().eq(self.geometry.response.p.tag),
            tester.i_words.p.word.eq(self.geometry.response.p.word),
            setup.margin.eq(job.scene.margin),
            traversal.root.eq(job.scene.root),
            tester.triangles.eq(job.scene.triangles),
            tester.vertices.eq(job.scene.vertices),
        ]
        wiring.connect(m, wiring.flipped(self.hits), recorder.port)

        # A job begins, and ends when each packet that was given has been written.
        begun = Signal()
        gives = Signal()
        packets = Signal(32)
        begins = self.i.valid & ~begun
        given = Mux(chosen[0], first.i.ready, last.i.ready)
        written = (recorder.written == packets) & ~self.hits.request.valid
        m.d.sync += [
            self.i.ready.eq(begun & ~giving & written & ~self.i.ready),
            gives.eq(first.gives | last.gives),  # known late in its cycle
            packets.eq(Mux(begins, 0, packets + gives)),
        ]
        with m.If(begins):
            m.d.sync += [begun.eq(1), giving.eq(1)]
        with m.If(giving & given):
            m.d.sync += giving.eq(0)
        with m.If(self.i.ready):
            m.d.sync += begun.eq(0)

        units = {"setup": setup, "planes": traversal, "triangles": tester}
        infinite |= {name: unit.overflow for name, unit in units.items()}
        m.submodules.census = places = Census(config)
        start = traversal.i_start
        started = start.valid & start.ready
        if config.instances:
            started &= ~start.p.level
            infinite["transform"] = self._instances(m, setup, traversal, tester, places, begins)
        m.d.sync += [
            self.overflows[name].eq(~begins & (self.overflows[name] | overflow))
            for name, overflow in infinite.items()
        ]

        m.d.comb += [
            *(unit.clear.eq(begins) for unit in (recorder, traversal, tester, places)),
            places.counts.eq(begun),
            places.started.eq(started),
            places.done.eq(traversal.o_done.valid & traversal.o_done.ready),
            places.asks_node.eq(self.nodes.request.valid & self.nodes.request.ready),
            places.has_node.eq(self.nodes.response.valid),
            places.asks_test.eq(traversal.o_tests.valid & traversal.o_tests.ready),
            places.has_test.eq(traversal.i_tests.valid & traversal.i_tests.ready),
            self.counters.packets.eq(recorder.written),
            self.counters.ray_tests.eq(tester.counters.ray_tests),
            self.counters.waits.eq(places.counters),
            *(
                self.counters[name].eq(traversal.counters[name])
                for name, _ in traversal.counters.shape()
            ),
        ]
        return m

    def _instances(
        self,
        m: Module,
        setup: Setup,
        traversal: Traversal,
        tester: Tester,
        places: Census,
        begins: Value,
    ) -> Value:
        """The way of packets into objects; whether a number becomes infinite on it."""
        m.submodules.transform = transform = Transform(self.config)
        entry, roots, start = tester.o_entries, traversal.i_roots, traversal.i_start
        wiring.connect(m, setup.o_worlds, transform.i_worlds)
        wiring.connect(m, entry, transform.i)
        wiring.connect(m, transform.o, setup.i_objects)
        enters = start.valid & start.ready & start.p.level
        m.d.comb += [
            roots.valid.eq(entry.valid & entry.ready),
            roots.p.packet.eq(entry.p.packet),
            roots.p.root.eq(entry.p.root),
            places.enters.eq(enters),
        ]
        m.d.sync += self.entries.eq(Mux(begins, 0, self.entries + enters))
        return transform.overflow
