"""The core: update processor and ray caster on one memory."""

from amaranth import *
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.rays import caster
from hdl.rays.caster import RayCaster, cast_job
from hdl.rays.memory import past_banks, through_bank, through_caches
from hdl.update import processor
from hdl.update.fetch import program
from hdl.update.processor import UpdateProcessor

CACHE = data.StructLayout({"hits": 32, "misses": 32})
INSTANCES = data.StructLayout({"entries": 32})


def counters(config: Config) -> data.StructLayout:
    """What a core counts.

    Of the last update, the last cast, and of the caches in it: zero where there are none. Of both,
    where numbers have become infinite. Nothing of an update where there is no update processor.
    Where there are instances, packets that entered one.
    """
    update, overflow = ({"update": processor.CYCLES}, {"update": 1}) if config.update else ({}, {})
    return data.StructLayout({
        **update,
        "cast": caster.COUNTERS,
        "nodes": CACHE,
        "geometry": CACHE,
        "overflows": data.StructLayout({**overflow, **caster.overflows(config).members}),
        **({"instances": INSTANCES} if config.instances else {}),
    })


def frame_job(config: Config) -> data.StructLayout:
    """A frame: an update where `program` has a length, then rays where `casts` is set.

    Without an update processor there is no program.
    """
    update = {"program": program(config)} if config.update else {}
    return data.StructLayout({**update, "casts": 1, "cast": cast_job(config)})


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

    Without an update processor it only casts rays, and has the memory port for that alone.

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
    counters : Out(counters)
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
            "counters": Out(counters(config)),
            "port": Out(Port(config)),
            **dict.fromkeys(banks, Out(Port(config))),
        })

    def elaborate(self, platform):
        m = Module()

        update = UpdateProcessor(self.config) if self.config.update else None
        if update:
            m.submodules.update = update
        m.submodules.caster = cast = RayCaster(self.config)
        overflows = self.counters.overflows
        m.d.comb += [
            self.counters.cast.eq(cast.counters),
            *(overflows[name].eq(cast.overflows[name]) for name, _ in cast.overflows.shape()),
        ]

        if self.config.instances:
            m.d.comb += self.counters.instances.entries.eq(cast.entries)

        # One after the other. The job stays here for as long as it takes.
        phase = Signal(Phase)
        idle, casting = Signal(init=1), Signal()  # of phase; go to many places
        job = Signal.like(self.i.p, reset_less=True)
        m.d.comb += [
            self.busy.eq(~idle),
            self.i.ready.eq(idle),
            cast.i.valid.eq(casting),
            cast.i.p.eq(job.cast),
        ]
        rays_port = self._rays_port(m, cast, phase == Phase.TURN)
        with m.If(idle):
            m.d.sync += job.eq(self.i.p)
        with m.Switch(phase):
            with m.Case(Phase.IDLE):
                with m.If(self.i.valid):
                    m.d.sync += [phase.eq(Phase.BEGIN if update else Phase.TURN), idle.eq(0)]
            with m.Case(Phase.TURN):
                m.d.sync += [phase.eq(Phase.CAST), casting.eq(job.casts)]
            with m.Case(Phase.CAST):
                with m.If(~casting | cast.i.ready):
                    m.d.sync += [phase.eq(Phase.DRAIN), casting.eq(0)]
            with m.Case(Phase.DRAIN):
                with m.If(~rays_port.request.valid & ~self.unsettled):
                    m.d.sync += [phase.eq(Phase.IDLE), idle.eq(1)]
        if update:
            self._update_first(m, update, phase, job, rays_port)
        else:
            wiring.connect(m, rays_port, wiring.flipped(self.port))
        return m

    def _update_first(
        self,
        m: Module,
        update: UpdateProcessor,
        phase: "enum.EnumView[Phase]",
        job: data.View,
        rays_port: PortInterface,
    ):
        """The phases of an update, in which it has the memory port."""
        updating = Signal()  # of phase; goes to many places
        updates = Signal()  # there is a program
        m.d.comb += [
            self.counters.update.eq(update.counters.cycles),
            self.counters.overflows.update.eq(update.counters.overflow),
            update.i.valid.eq((phase == Phase.BEGIN) & updates),
            update.i.p.program.eq(job.program),
            update.i.p.vertices.eq(job.cast.scene.vertices),
            update.i.p.nodes.eq(job.cast.scene.nodes),
        ]
        with m.Switch(phase):
            with m.Case(Phase.IDLE):
                m.d.sync += [
                    updates.eq(self.i.p.program.length != 0),
                    updating.eq(self.i.valid),
                ]
            with m.Case(Phase.BEGIN):
                m.d.sync += phase.eq(Mux(updates, Phase.UPDATE, Phase.TURN))
            with m.Case(Phase.UPDATE):
                with m.If(~update.busy & ~self.unsettled):
                    m.d.sync += phase.eq(Phase.TURN)
            with m.Case(Phase.TURN):
                m.d.sync += updating.eq(0)

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

    def _rays_port(self, m: Module, cast: RayCaster, clear: Value) -> PortInterface:
        """The port through which rays reach memory: nodes and geometry too, if by caches."""
        if not self.config.cache_words:
            for name in ("nodes", "geometry"):
                port = getattr(cast, name)
                through_bank(m, self.config, name, port, wiring.flipped(getattr(self, name)))
            return past_banks(m, self.config, cast)
        rays_port, caches = through_caches(m, self.config, cast, clear)
        for name, cache in caches.items():
            m.d.comb += [
                self.counters[name].hits.eq(cache.hits),
                self.counters[name].misses.eq(cache.misses),
            ]
        return rays_port
