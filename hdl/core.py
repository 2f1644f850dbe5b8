"""The core: update processor and ray caster on one memory."""

from amaranth import *
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.arbiter import Arbiter
from hdl.memory.cache import Cache
from hdl.memory.inorder import InOrder
from hdl.memory.port import Port, PortInterface
from hdl.rays import caster
from hdl.rays.caster import RayCaster, cast_job
from hdl.update import processor
from hdl.update.fetch import program
from hdl.update.processor import UpdateProcessor

CACHE = data.StructLayout({"hits": 32, "misses": 32})
COUNTERS = data.StructLayout({
    "update": processor.CYCLES,
    "cast": caster.COUNTERS,
    "nodes": CACHE,
    "geometry": CACHE,
    "overflows": data.StructLayout({"update": 1, **caster.OVERFLOWS.members}),
})
"""Of the last update, the last cast, and of the caches in it: zero where there are none. Of both,
where numbers have become infinite."""


def frame_job(config: Config) -> data.StructLayout:
    """A frame: an update where `program` has a length, then rays where `casts` is set."""
    return data.StructLayout({"program": program(config), "casts": 1, "cast": cast_job(config)})


class Phase(enum.Enum, shape=3):
    """Who is at work."""

    IDLE = 0
    BEGIN = 1  # the update gets its job, if there is one
    UPDATE = 2
    TURN = 3  # from the update to the rays: caches forget
    CAST = 4
    DRAIN = 5  # the last hits are on their way to memory


class Core(wiring.Component):
    """Updates a tree, then casts rays through it: both, or either alone.

    With caches there is one port. Without, for memory on the chip, nodes and geometry are read
    through ports of their own. What the update has written has to be there for the rays, on all
    ports, before `unsettled` falls.

    ::

        update processor ─────────────────────┐
        ray caster ──┬─────────────┐          ├─► port
                     ├─► nodes ────┤ arbiter ─┘
                     └─► geometry ─┘

    Parameters
    ----------
    config : Config

    Members
    -------
    i : In(stream of frame_job), taken while not busy
    busy : Out(1); falls when all of a job's nodes and hits are in memory
    unsettled : In(1), a write that the port took has not taken effect; may stay unconnected where
        each does before the next request
    counters : Out(COUNTERS)
    port : Out(Port)
    nodes, geometry : Out(Port), reads only; where `config.cache_words` is 0
    """

    i: stream.Interface
    busy: Signal
    unsettled: Signal
    counters: data.View
    port: PortInterface
    nodes: PortInterface
    geometry: PortInterface

    def __init__(self, config: Config):
        self.config = config
        banks = () if config.cache_words else ("nodes", "geometry")
        super().__init__({
            "i": In(stream.Signature(frame_job(config))),
            "busy": Out(1),
            "unsettled": In(1),
            "counters": Out(COUNTERS),
            "port": Out(Port(config)),
            **dict.fromkeys(banks, Out(Port(config))),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.update = update = UpdateProcessor(self.config)
        m.submodules.caster = cast = RayCaster(self.config)
        overflows = self.counters.overflows
        m.d.comb += [
            self.counters.update.eq(update.counters.cycles),
            self.counters.cast.eq(cast.counters),
            overflows.update.eq(update.counters.overflow),
            *(overflows[name].eq(cast.overflows[name]) for name, _ in caster.OVERFLOWS),
        ]

        # One after the other. The job stays here for as long as it takes.
        phase = Signal(Phase)
        idle, updating, casting = Signal(init=1), Signal(), Signal()  # of phase; go to many places
        job = Signal.like(self.i.p, reset_less=True)
        updates = Signal()  # there is a program
        m.d.comb += [
            self.busy.eq(~idle),
            self.i.ready.eq(idle),
            update.i.valid.eq((phase == Phase.BEGIN) & updates),
            update.i.p.program.eq(job.program),
            update.i.p.vertices.eq(job.cast.scene.vertices),
            update.i.p.nodes.eq(job.cast.scene.nodes),
            cast.i.valid.eq(casting),
            cast.i.p.eq(job.cast),
        ]
        connect = self._caches if self.config.cache_words else self._banks
        rays_port = connect(m, cast, phase == Phase.TURN)
        with m.If(idle):
            m.d.sync += [job.eq(self.i.p), updates.eq(self.i.p.program.length != 0)]
        with m.Switch(phase):
            with m.Case(Phase.IDLE):
                with m.If(self.i.valid):
                    m.d.sync += [phase.eq(Phase.BEGIN), idle.eq(0), updating.eq(1)]
            with m.Case(Phase.BEGIN):
                m.d.sync += phase.eq(Mux(updates, Phase.UPDATE, Phase.TURN))
            with m.Case(Phase.UPDATE):
                with m.If(~update.busy & ~self.unsettled):
                    m.d.sync += phase.eq(Phase.TURN)
            with m.Case(Phase.TURN):
                m.d.sync += [phase.eq(Phase.CAST), updating.eq(0), casting.eq(job.casts)]
            with m.Case(Phase.CAST):
                with m.If(~casting | cast.i.ready):
                    m.d.sync += [phase.eq(Phase.DRAIN), casting.eq(0)]
            with m.Case(Phase.DRAIN):
                with m.If(~rays_port.request.valid & ~self.unsettled):
                    m.d.sync += [phase.eq(Phase.IDLE), idle.eq(1)]

        request, response = self.port.request, self.port.response
        for unit, works in [(update.port, updating), (rays_port, ~updating)]:
            m.d.comb += [
                unit.request.ready.eq(works & request.ready),
                unit.response.valid.eq(works & response.valid),
                unit.response.payload.eq(response.payload),
            ]
            with m.If(works):
                m.d.comb += [
                    request.valid.eq(unit.request.valid),
                    request.p.eq(unit.request.p),
                ]
        return m

    def _caches(self, m: Module, cast: RayCaster, clear: Value) -> PortInterface:
        """Nodes and geometry through caches; the port that they share with the rest."""
        config = self.config
        # Nodes first: each packet waits for one. Rays last: they are asked for early.
        m.submodules.arbiter = arbiter = Arbiter(
            config, clients=4, outstanding=2 * config.packets + config.latency + 8
        )
        for name, client in zip(("nodes", "geometry"), arbiter.clients, strict=False):
            reads = getattr(cast, name)
            cache = Cache(
                config, words=config.cache_words, tags=reads.signature.tags, misses=config.packets
            )
            m.submodules[f"{name}_cache"] = cache
            wiring.connect(m, reads, cache.reads)
            wiring.connect(m, cache.port, client)
            m.d.comb += [
                cache.clear.eq(clear),
                self.counters[name].hits.eq(cache.hits),
                self.counters[name].misses.eq(cache.misses),
            ]
        wiring.connect(m, cast.hits, arbiter.clients[2])
        wiring.connect(m, cast.rays, arbiter.clients[3])
        return arbiter.port

    def _banks(self, m: Module, cast: RayCaster, _: Value) -> PortInterface:
        """Nodes and geometry from ports of their own; the port that serves the rest."""
        for name in ("nodes", "geometry"):
            reads = getattr(cast, name)
            bank = InOrder(self.config, tags=reads.signature.tags, outstanding=self.config.packets)
            m.submodules[f"{name}_bank"] = bank
            wiring.connect(m, reads, bank.reads)
            wiring.connect(m, wiring.flipped(getattr(self, name)), bank.port)
        m.submodules.arbiter = arbiter = Arbiter(
            self.config, clients=2, outstanding=self.config.latency + 8
        )
        wiring.connect(m, cast.hits, arbiter.clients[0])
        wiring.connect(m, cast.rays, arbiter.clients[1])
        return arbiter.port
