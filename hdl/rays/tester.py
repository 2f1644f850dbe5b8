"""What stands between traversal and the triangle test: rays, corners and hits of all packets."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.rays.corners import CORNERS, Corners, read, row, word
from hdl.rays.delay import Pipeline
from hdl.rays.hits import Hits
from hdl.rays.packet import RAYS, hit, level, numbered, packet_bits, sheared_ray
from hdl.rays.stack import leaf_test, tested
from hdl.rays.triangle import Intersect

COUNTERS = data.StructLayout({"tests": 32, "ray_tests": 32})
"""Packets at leaves, and rays of those at triangles that may hit."""


def tester_ray(config: Config) -> data.StructLayout:
    """A ray of a packet that is to begin, or where `level` is 1 to enter an object."""
    fmt = config.fmt
    return numbered(config, {**level(config), "ray": sheared_ray(fmt), "t_max": fmt.layout})


def entry(config: Config) -> data.StructLayout:
    """A packet at an instance, its rays that may hit it, and its rows x, y and z."""
    return data.StructLayout({
        "packet": packet_bits(config),
        "mask": RAYS,
        "rows": data.ArrayLayout(row(config.fmt), len(CORNERS)),
        "root": config.pointer_bits,
    })


class Tester(wiring.Component):
    """Tests packets against triangles, and keeps the first hit of each ray.

    One triangle in as many cycles as the most of four words and its rays; from the last word to
    the answer it takes `latency` cycles and one more for each ray. A packet has at most one test
    under way, and is done after its answer. (Hits says what counts.)

    A packet at an instance leaves as `o_entries`, 4 cycles after the last word, and goes on in the
    object with other rays. Triangles that it meets there are of that instance.

    Parameters
    ----------
    config : Config

    Members
    -------
    triangles, vertices : In(address), of the first of each; constant while packets are under way
    clear : In(1), counters start again
    i_rays : In(stream of tester_ray), before the packet's tests
    i_tests : In(stream of leaf_test)
    o_tests : Out(stream of tested)
    o_entries : Out(stream of entry), where there are instances
    o_reads : Out(stream of {tag, address})
    i_words : In(stream of {tag, word}), in any order, taken at once
    i_done : In(stream of packets)
    o_hits : Out(stream of {packet, number, hit}), four a packet, in order
    overflow : Out(1), a number has become infinite
    counters : Out(COUNTERS)
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
        self.latency = 4 + Intersect.latency_of(config.fmt) + Hits.latency
        packet = packet_bits(config)
        entries = Out(stream.Signature(entry(config)))
        super().__init__({
            "triangles": In(config.address_bits),
            "vertices": In(config.address_bits),
            "clear": In(1),
            "i_rays": In(stream.Signature(tester_ray(config))),
            "i_tests": In(stream.Signature(leaf_test(config))),
            "o_tests": Out(stream.Signature(tested(config))),
            **({"o_entries": entries} if config.instances else {}),
            "o_reads": Out(stream.Signature(read(config))),
            "i_words": In(stream.Signature(word(config), always_ready=True)),
            "i_done": In(stream.Signature(packet)),
            "o_hits": Out(stream.Signature(numbered(config, {"hit": hit(config)}))),
            "overflow": Out(1),
            "counters": Out(COUNTERS),
        })

    def elaborate(self, platform):
        m = Module()

        packets, fmt, instances = self.config.packets, self.config.fmt, self.config.instances
        m.submodules.corners = corners = Corners(self.config)
        m.submodules.intersect = intersect = Intersect(fmt)
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

        # A ray comes, to here and to its hit record.
        m.submodules.rays = rays = memory.Memory(
            shape=sheared_ray(fmt), depth=RAYS * packets << instances, init=[]
        )
        write_ray, ray = rays.write_port(), rays.read_port()
        m.d.comb += [
            self.i_rays.ready.eq(hits.i_rays.ready),
            hits.i_rays.valid.eq(self.i_rays.valid),
            hits.i_rays.p.packet.eq(self.i_rays.p.packet),
            hits.i_rays.p.number.eq(self.i_rays.p.number),
            hits.i_rays.p.t_max.eq(self.i_rays.p.t_max),
            write_ray.en.eq(self.i_rays.valid & self.i_rays.ready),
            write_ray.addr.eq(
                Cat(self.i_rays.p[name] for name in ("number", *level(self.config), "packet"))
            ),
            write_ray.data.eq(self.i_rays.p.ray),
        ]

        # A test comes: its triangle and mask wait for the corners.
        triangle = self.config.pointer_bits
        waiting = data.StructLayout({"triangle": triangle, "mask": RAYS, **level(self.config)})
        m.submodules.tests = tests = memory.Memory(shape=waiting, depth=packets, init=[])
        write_test, test = tests.write_port(), tests.read_port(domain="comb")
        m.d.comb += [
            self.i_tests.ready.eq(corners.i.ready),
            corners.i.valid.eq(self.i_tests.valid),
            corners.i.p.packet.eq(self.i_tests.p.packet),
            corners.i.p.triangle.eq(self.i_tests.p.triangle),
            write_test.en.eq(self.i_tests.valid & self.i_tests.ready),
            write_test.addr.eq(self.i_tests.p.packet),
            write_test.data.triangle.eq(self.i_tests.p.triangle),
            write_test.data.mask.eq(self.i_tests.p.mask),
        ]

        if instances:  # what a ray has hit stays as it enters an object
            m.d.comb += [
                hits.i_rays.valid.eq(self.i_rays.valid & ~self.i_rays.p.level),
                write_test.data.level.eq(self.i_tests.p.level),
            ]

        # Its corners come: its rays go, one a cycle. Nothing waits from here on.
        turn = Signal(waiting, reset_less=True)  # what is left of a test
        packet = Signal.like(corners.o.p, reset_less=True)
        busy, first, picked = Signal(), Signal(), Signal(RAYS)
        number = Signal(range(RAYS))
        last = turn.mask == picked
        place = Cat(number, turn.level if instances else [], packet)
        m.d.comb += [
            test.addr.eq(corners.o.p),
            corners.o.ready.eq(~busy | last),
            picked.eq(turn.mask & -turn.mask),
            number.eq(Cat(picked[1] | picked[3], picked[2] | picked[3])),
            corners.packet.eq(packet),
            ray.addr.eq(place),
        ]
        m.d.sync += [first.eq(0), turn.mask.eq(turn.mask & ~picked)]
        with m.If(corners.o.ready):
            m.d.sync += [
                busy.eq(corners.o.valid),
                packet.eq(corners.o.p),
                turn.eq(test.data),
                first.eq(1),
            ]

        # next cycle: read; the one after it: intersect
        tests_ray, instance = busy, []
        if instances:
            entering, instance = self._enter(m, corners, test, turn, packet, busy, last)
            tests_ray = busy & ~entering
        leaf = {"triangle": triangle, **({"instance": triangle} if instances else {})}
        fields = numbered(self.config, {"first": 1, "last": 1, **leaf})
        reading, about = (
            Signal(fields, name=stage, reset_less=True) for stage in ("reading", "about")
        )
        reads = Signal()
        m.d.sync += [
            reads.eq(tests_ray),
            reading.eq(Cat(packet, number, first, last, turn.triangle, instance)),
        ]
        entered = Signal(Intersect.operands(fmt), reset_less=True)
        m.d.sync += [
            intersect.i.valid.eq(reads),
            about.eq(reading),
            entered.ray.eq(ray.data),
            *(entered[v].eq(corners.corners[v]) for v in CORNERS),
        ]
        m.d.comb += [
            intersect.i.p.eq(entered),
            intersect.o.ready.eq(1),
            hits.i.valid.eq(intersect.o.valid),
            self.overflow.eq(intersect.overflow),
        ]
        p = Pipeline()
        m.submodules.beside = p.m
        t_min = p.at(p.input("t_min", entered.ray.t_min), intersect.latency)
        late = data.View(fields, p.at(p.input("about", about), intersect.latency))
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
                self.counters.ray_tests.eq(self.counters.ray_tests + tests_ray),
            ]
        return m

    def _enter(
        self,
        m: Module,
        corners: Corners,
        test: memory.ReadPort,
        turn: data.View,
        packet: Signal,
        busy: Signal,
        last: Value,
    ) -> tuple[Value, Value]:
        """An instance takes a turn of a cycle, in which its rows are read, before all triangles.

        Gives whether it does, and the instance that the triangle of a turn is of.
        """
        waiting, o, packets = corners.o_instances, self.o_entries, self.config.packets
        entering, enters = Signal(), Signal()  # rows are asked for, are there
        mask = Signal(RAYS, reset_less=True)
        of = Signal.like(packet, name="entering_packet", reset_less=True)
        free = ~busy | last | entering
        takes = waiting.valid & ~entering & ~enters & (~o.valid | o.ready)
        m.d.comb += [waiting.ready.eq(free & takes), corners.o.ready.eq(free & ~takes)]
        m.d.sync += [
            entering.eq(free & takes),
            enters.eq(entering),
            mask.eq(turn.mask),
            of.eq(packet),
        ]
        with m.If(takes):
            m.d.comb += test.addr.eq(waiting.p)
        with m.If(free & takes):
            m.d.sync += [busy.eq(1), packet.eq(waiting.p), turn.eq(test.data)]
        with m.If(o.ready):
            m.d.sync += o.valid.eq(0)
        with m.If(enters):
            m.d.sync += [
                o.valid.eq(1),
                o.p.packet.eq(of),
                o.p.mask.eq(mask),
                o.p.root.eq(corners.root),
                *(to.eq(corners.corners[v]) for to, v in zip(o.p.rows, CORNERS, strict=True)),
            ]

        # The object that each packet is in, or entered last.
        m.submodules.objects = objects = memory.Memory(
            shape=turn.triangle.shape(), depth=packets, init=[]
        )
        write, inside = objects.write_port(), objects.read_port(domain="comb")
        instance = Signal.like(turn.triangle, reset_less=True)
        m.d.comb += [
            write.en.eq(entering),
            write.addr.eq(packet),
            write.data.eq(turn.triangle),
            inside.addr.eq(corners.o.p),
        ]
        with m.If(corners.o.ready):
            m.d.sync += instance.eq(Mux(test.data.level, inside.data, ~0))
        return entering, instance
