"""What stands between traversal and the triangle test: rays, corners and hits of all packets."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.rays.corners import CORNERS, Corners, corner, read, word
from hdl.rays.delay import Pipeline
from hdl.rays.folded import FoldedIntersect
from hdl.rays.hits import Hits, surface
from hdl.rays.packet import AXES, RAYS, hit, level, numbered, packet_bits, sheared_ray
from hdl.rays.stack import tested
from hdl.rays.triangle import Intersect
from hdl.rays.turns import TURNS

COUNTERS = data.StructLayout({"tests": 32, "ray_tests": 32})
"""Packets at triangles, and rays of them that may hit."""


def tester_ray(config: Config) -> data.StructLayout:
    """A ray of a packet that is to begin, or with level 1 to enter an object."""
    ray = {"ray": sheared_ray(config.fmt), "t_max": config.fmt.layout}
    return numbered(config, {**level(config), **ray})


def entry(config: Config) -> data.StructLayout:
    """A packet that is to enter an object: the rows of its instance, and the root of its tree."""
    rows = dict.fromkeys(("x", "y", "z"), corner(config))
    fields = {"packet": packet_bits(config), "root": config.pointer_bits, **rows}
    return data.StructLayout(fields)


class Tester(wiring.Component):
    """Tests packets against triangles, and keeps the first hit of each ray.

    One triangle in as many cycles as the most of four words and `turns` for each ray; from the last
    word to the answer it takes `latency` cycles and `turns` more for each ray, and where units
    take turns up to two until the first. A packet has at most one test under way, and is done
    after its answer. (Hits says what counts.) The answer of an instance is that the packet is to
    enter its object.

    Parameters
    ----------
    config : Config

    Members
    -------
    triangles, vertices : In(address), of the first of each; constant while packets are under way
    clear : In(1), counters start again
    i_rays : In(stream of tester_ray), before the packet's tests
    i_tests : In(stream of {packet, level, triangle, mask: rays that may hit it, one at least});
        level where there are instances
    o_tests : Out(stream of tested)
    o_entries : Out(stream of entry), where there are instances
    o_reads : Out(stream of {tag, address})
    i_words : In(stream of {tag, word}), in any order, taken at once
    i_done : In(stream of packets)
    o_hits : Out(stream of {packet, number, hit}), four a packet, in order
    overflow : Out(1), a number has become infinite
    counters : Out(COUNTERS)

    Attributes
    ----------
    turns : int
        Cycles of a ray: 3 where units take turns, or 1.
    latency : int
    """

    triangles: Signal
    vertices: Signal
    clear: Signal
    i_rays: stream.Interface
    i_tests: stream.Interface
    o_tests: stream.Interface
    o_entries: stream.Interface
    o_reads: stream.Interface
    i_words: stream.Interface
    i_done: stream.Interface
    o_hits: stream.Interface
    overflow: Signal
    counters: data.View

    def __init__(self, config: Config):
        self.config = config
        self.turns = TURNS if config.folded else 1
        intersect = (FoldedIntersect if config.folded else Intersect).latency_of(config.fmt)
        self.latency = 4 + intersect + Hits.latency_of(config) - config.folded
        packet = packet_bits(config)
        triangle = config.pointer_bits
        test = {"packet": packet, **level(config), "triangle": triangle, "mask": RAYS}
        super().__init__({
            "triangles": In(config.address_bits),
            "vertices": In(config.address_bits),
            "clear": In(1),
            "i_rays": In(stream.Signature(tester_ray(config))),
            "i_tests": In(stream.Signature(data.StructLayout(test))),
            "o_tests": Out(stream.Signature(tested(config))),
            **({"o_entries": Out(stream.Signature(entry(config)))} if config.instances else {}),
            "o_reads": Out(stream.Signature(read(config))),
            "i_words": In(stream.Signature(word(config), always_ready=True)),
            "i_done": In(stream.Signature(packet)),
            "o_hits": Out(stream.Signature(numbered(config, {"hit": hit(config)}))),
            "overflow": Out(1),
            "counters": Out(COUNTERS),
        })

    def elaborate(self, platform):
        m = Module()

        packets, fmt, folded = self.config.packets, self.config.fmt, self.config.folded
        m.submodules.corners = corners = Corners(self.config)
        m.submodules.intersect = intersect = FoldedIntersect(fmt) if folded else Intersect(fmt)
        phase = intersect.turn if isinstance(intersect, FoldedIntersect) else C(0)
        m.submodules.hits = hits = Hits(self.config)
        for mine, unit in (
            (self.o_reads, corners.o_reads),
            (self.i_words, corners.i_words),
            (self.o_tests, hits.o_tests),
            (self.i_done, hits.i_done),
            (self.o_hits, hits.o_hits),
        ):
            wiring.connect(m, wiring.flipped(mine), unit)
        m.d.comb += [
            corners.triangles.eq(self.triangles),
            corners.vertices.eq(self.vertices),
        ]

        # A ray comes, to here and, if it begins, to its hit record.
        levels = len(level(self.config))
        rows = 2 << packet_bits(self.config) if levels else packets
        m.submodules.rays = rays = memory.Memory(shape=sheared_ray(fmt), depth=RAYS * rows, init=[])
        write_ray, ray = rays.write_port(), rays.read_port()
        enters = self.i_rays.p.level if levels else Const(0)
        m.d.comb += [
            self.i_rays.ready.eq(hits.i_rays.ready),
            hits.i_rays.valid.eq(self.i_rays.valid & ~enters),
            hits.i_rays.p.packet.eq(self.i_rays.p.packet),
            hits.i_rays.p.number.eq(self.i_rays.p.number),
            hits.i_rays.p.t_max.eq(self.i_rays.p.t_max),
            write_ray.en.eq(self.i_rays.valid & self.i_rays.ready),
            write_ray.addr.eq(self._place(self.i_rays.p.number, self.i_rays.p.packet, enters)),
            write_ray.data.eq(self.i_rays.p.ray),
        ]

        # A test comes: its triangle and mask wait for the corners.
        triangle = self.config.pointer_bits
        waiting = data.StructLayout({**level(self.config), "triangle": triangle, "mask": RAYS})
        m.submodules.tests = tests = memory.Memory(shape=waiting, depth=packets, init=[])
        write_test, test = tests.write_port(), tests.read_port(domain="comb")
        m.d.comb += [
            self.i_tests.ready.eq(corners.i.ready),
            corners.i.valid.eq(self.i_tests.valid),
            corners.i.p.packet.eq(self.i_tests.p.packet),
            corners.i.p.triangle.eq(self.i_tests.p.triangle),
            write_test.en.eq(self.i_tests.valid & self.i_tests.ready),
            write_test.addr.eq(self.i_tests.p.packet),
            *(write_test.data[name].eq(self.i_tests.p[name]) for name, _ in waiting),
        ]

        # Its corners come: its rays go, one a cycle. Nothing waits from here on. Where units take
        # turns, a ray goes two cycles before its first one.
        turn = Signal(waiting, reset_less=True)  # what is left of a test
        packet = Signal.like(corners.o.p, reset_less=True)
        busy, first, picked = Signal(), Signal(), Signal(RAYS)
        number = Signal(range(RAYS))
        last = turn.mask == picked
        goes = phase == (TURNS - 1 - 2) % TURNS if folded else C(1)
        free = (~busy | last) & goes
        instance, enters = self._entries(m, corners, packet, turn, free)
        next_packet = Mux(enters, corners.o_instances.p, corners.o.p) if levels else corners.o.p
        m.d.comb += [
            test.addr.eq(next_packet),
            corners.o.ready.eq(free & ~enters),
            picked.eq(turn.mask & -turn.mask),
            number.eq(Cat(picked[1] | picked[3], picked[2] | picked[3])),
            corners.packet.eq(packet),
            ray.addr.eq(self._place(number, packet, turn.level if levels else Const(0))),
        ]
        if folded:
            m.d.comb += corners.part.eq(Mux(goes, TURNS - 1, phase - 1))
        with m.If(goes):
            m.d.sync += [first.eq(0), turn.mask.eq(turn.mask & ~picked)]
        with m.If(free):
            m.d.sync += [
                busy.eq(corners.o.valid & ~enters),
                packet.eq(next_packet),
                turn.eq(test.data),
                first.eq(1),
            ]

        # next cycle: read; the one after it: intersect
        fields = numbered(self.config, {"first": 1, "last": 1, **surface(self.config)})
        reading, about = (
            Signal(fields, name=stage, reset_less=True) for stage in ("reading", "about")
        )
        reads = Signal()
        m.d.sync += [
            reads.eq(busy),
            reading.eq(Cat(packet, number, first, last, turn.triangle, *instance)),
        ]
        entered = Signal(Intersect.operands(fmt), reset_less=True)
        kept = CORNERS[:1] if folded else CORNERS  # all corners in one register, each in its turn
        m.d.sync += [
            intersect.i.valid.eq(reads),
            about.eq(reading),
            entered.ray.eq(ray.data),
            *(entered[v][a].eq(corners.corners[v][a]) for v in kept for a in AXES),
        ]
        m.d.comb += [
            intersect.i.p.ray.eq(entered.ray),
            *(intersect.i.p[v].eq(entered[kept[k % len(kept)]]) for k, v in enumerate(CORNERS)),
            intersect.o.ready.eq(1),
            hits.i.valid.eq(intersect.o.valid),
            self.overflow.eq(intersect.overflow),
        ]
        p = Pipeline()
        latency = intersect.latency
        if folded:  # a step for each ray, in the last of its turns
            m.submodules.beside = EnableInserter(phase == TURNS - 1)(p.m)
            latency = (latency + TURNS - 1) // TURNS
        else:
            m.submodules.beside = p.m
        t_min = p.at(p.input("t_min", entered.ray.t_min), latency)
        late = data.View(fields, p.at(p.input("about", about), latency))
        m.d.comb += [
            *(hits.i.p[field].eq(late[field]) for field, _ in fields),
            hits.i.p.t_min.eq(t_min),
            *(hits.i.p[field].eq(intersect.o.p[field]) for field in ("hit", "t", "u", "v")),
        ]

        with m.If(self.clear):
            m.d.sync += self.counters.eq(0)
        with m.Else():
            m.d.sync += [
                self.counters.tests.eq(self.counters.tests + write_test.en),
                self.counters.ray_tests.eq(self.counters.ray_tests + (busy & goes)),
            ]
        return m

    def _entries(self, m: Module, corners: Corners, packet: Value, turn: data.View, free: Value):
        """Packets at instances, which are to enter them.

        Returns the instance of the packet whose turn it is, and whether one enters.
        """
        if not self.config.instances:
            return (), Const(0)
        i, o, packets = corners.o_instances, self.o_entries, self.config.packets
        # Taken; next cycle: read its rows; the one after it: give them. (Or one in each.)
        reads, gives = Signal(), Signal(self.turns)
        enters = Signal()
        of = Signal.like(packet, name="entering", reset_less=True)
        m.d.comb += [
            enters.eq(free & i.valid & ~(reads | gives.any() | o.valid)),
            i.ready.eq(enters),
        ]
        m.d.sync += [reads.eq(enters), gives.eq(Cat(reads, gives)), of.eq(packet)]
        with m.If(gives[-1]):
            m.d.sync += [o.valid.eq(1), o.p.packet.eq(of), o.p.root.eq(corners.root)]
        for k, (a, v) in enumerate(zip(AXES, CORNERS, strict=True)):
            with m.If(gives[k % self.turns]):
                m.d.sync += o.p[a].eq(corners.corners[v])
        with m.If(o.valid & o.ready):
            m.d.sync += o.valid.eq(0)

        # Which one each packet is in, of all that it meets there.
        m.submodules.instances = instances = memory.Memory(
            shape=self.config.pointer_bits, depth=packets, init=[]
        )
        write, read = instances.write_port(), instances.read_port(domain="comb")
        m.d.comb += [
            write.en.eq(reads),
            write.addr.eq(packet),
            write.data.eq(turn.triangle),
            read.addr.eq(packet),
        ]
        return (Mux(turn.level, read.data, ~C(0, self.config.pointer_bits)),), enters

    def _place(self, number: Value, packet: Value, of: Value) -> Value:
        """Where a ray is, of a packet on a level."""
        return Cat(number, packet, of if self.config.instances else ())
