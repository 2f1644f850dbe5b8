"""Brings the corners of triangles from memory."""

from amaranth import *
from amaranth.lib import data, fifo, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.rays.banks import BLOCK_RAM
from hdl.rays.packet import packet_bits

CORNERS = ("v0", "v1", "v2")
RECORD = len(CORNERS)
"""The part of the triangle's record; those below it are its corners."""


def tag(config: Config) -> data.StructLayout:
    """What a word is for: the triangle that a packet meets, and which part of it."""
    return data.StructLayout({"packet": packet_bits(config), "part": range(RECORD + 1)})


def read(config: Config) -> data.StructLayout:
    """A word to read, from an address in words."""
    return data.StructLayout({"tag": tag(config), "address": config.address_bits})


def word(config: Config) -> data.StructLayout:
    """A word that was read."""
    return data.StructLayout({"tag": tag(config), "word": records.word_bits(config.fmt)})


def corner(config: Config) -> data.StructLayout:
    """What of a word is kept: a vertex, or where there are instances a row of one."""
    fmt = config.fmt.layout
    numbers = ("x", "y", "z", "offset") if config.instances else ("x", "y", "z")
    return data.StructLayout(dict.fromkeys(numbers, fmt))


class Corners(wiring.Component):
    """Reads a leaf's record and then its vertices or rows, for as many packets as there are.

    A triangle takes four words; one word a cycle. A word asks for the next one 2 cycles later; a
    packet is given two cycles after its last word. One packet has one triangle at most, until it
    is given and, after that, its corners read.

    Parameters
    ----------
    config : Config

    Members
    -------
    triangles, vertices : In(address), of the first of each; constant while packets are under way
    i : In(stream of {packet, triangle})
    o_reads : Out(stream of {tag, address})
    i_words : In(stream of {tag, word}), in any order, taken at once
    o : Out(stream of packets) at a triangle, as their corners are there
    packet : In(packet)
    part : In(range(3)), where units take turns
    corners : Out(corner by name), of the packet one cycle ago; where units take turns, all are the
        one of the part one cycle ago
    o_instances : Out(stream of packets) at an instance, as its rows are there; if there are any
    root : Out(pointer), of the packet one cycle ago; likewise
    """

    triangles: Signal
    vertices: Signal
    i: stream.Interface
    o_reads: stream.Interface
    i_words: stream.Interface
    o: stream.Interface
    packet: Signal
    part: Signal
    corners: data.View
    o_instances: stream.Interface
    root: Signal

    def __init__(self, config: Config):
        self.config = config
        packet = packet_bits(config)
        self.test = data.StructLayout({"packet": packet, "triangle": config.pointer_bits})
        super().__init__({
            "triangles": In(config.address_bits),
            "vertices": In(config.address_bits),
            "i": In(stream.Signature(self.test)),
            "o_reads": Out(stream.Signature(read(config))),
            "i_words": In(stream.Signature(word(config), always_ready=True)),
            "o": Out(stream.Signature(packet)),
            "packet": In(packet),
            **({"part": In(range(RECORD))} if config.folded else {}),
            "corners": Out(data.StructLayout(dict.fromkeys(CORNERS, corner(config)))),
            **(
                {
                    "o_instances": Out(stream.Signature(packet)),
                    "root": Out(config.pointer_bits),
                }
                if config.instances
                else {}
            ),
        })

    def elaborate(self, platform):
        m = Module()

        packets, word = self.config.packets, self.i_words.p
        record = data.StructLayout({"packet": len(self.packet), "vertices": records.TRIANGLE})
        # No queue is ever full: no packet is in it twice.
        m.submodules.tests = tests = fifo.SyncFIFO(width=self.test.size, depth=packets)
        m.submodules.found = found = fifo.SyncFIFO(width=record.size, depth=packets)
        m.submodules.ready = ready = fifo.SyncFIFO(width=len(self.o.p), depth=packets)
        m.d.comb += [
            tests.w_en.eq(self.i.valid),
            tests.w_data.eq(self.i.p),
            self.i.ready.eq(tests.w_rdy),
            found.w_en.eq(self.i_words.valid & (word.tag.part == RECORD)),
            found.w_data.eq(Cat(word.tag.packet, word.word)),
            self.o.valid.eq(ready.r_rdy),
            self.o.p.eq(ready.r_data),
            ready.r_en.eq(self.o.ready),
        ]

        # What has begun goes first.
        test, triangle = data.View(self.test, tests.r_data), data.View(record, found.r_data)
        reads, part = self.o_reads, Signal(range(RECORD))
        with m.If(~reads.valid | reads.ready):
            m.d.sync += reads.valid.eq(tests.r_rdy | found.r_rdy)
            with m.If(found.r_rdy):
                last = part == RECORD - 1
                vertex = Array(triangle.vertices[v] for v in CORNERS)[part]
                m.d.comb += found.r_en.eq(last)
                m.d.sync += [
                    part.eq(Mux(last, 0, part + 1)),
                    reads.p.tag.packet.eq(triangle.packet),
                    reads.p.tag.part.eq(part),
                    reads.p.address.eq(self.vertices + vertex),
                ]
            with m.Else():
                m.d.comb += tests.r_en.eq(1)
                m.d.sync += [
                    reads.p.tag.packet.eq(test.packet),
                    reads.p.tag.part.eq(RECORD),
                    reads.p.address.eq(self.triangles + test.triangle),
                ]

        # Which of the corners are there; the cycle after each, whether they are all.
        there = Signal(data.ArrayLayout(RECORD, packets))
        came, packet, complete = Signal(), Signal.like(self.packet), Signal()
        is_corner = self.i_words.valid & (word.tag.part != RECORD)
        m.d.sync += [came.eq(is_corner), packet.eq(word.tag.packet)]
        m.d.comb += [
            complete.eq(came & Cat(parts.all() for parts in there).bit_select(packet, 1)),
            ready.w_en.eq(complete),
            ready.w_data.eq(packet),
        ]
        if self.config.instances:
            self._instances(m, complete, packet, ready.w_en)
        with m.If(is_corner):
            m.d.sync += there[word.tag.packet].bit_select(word.tag.part, 1).eq(1)
        with m.If(complete):
            m.d.sync += there[packet].eq(0)
        if self.config.folded:
            of = self._kept(m, "kept", is_corner, word.tag.part, self.part)
            m.d.comb += [self.corners[name].eq(of) for name in CORNERS]
        else:
            for index, name in enumerate(CORNERS):
                here = self.i_words.valid & (word.tag.part == index)
                m.d.comb += self.corners[name].eq(self._kept(m, name, here))
        return m

    def _kept(self, m: Module, name: str, en: Value, *parts: Value) -> data.View:
        """A memory of corners, written where `en`, with a row for each packet and part.

        `parts` are none, or that which is written and that which is read. Returns what is read.
        """
        word, (written, read) = self.i_words.p, parts or (C(0, 0), C(0, 0))
        depth = self.config.packets << len(written)
        kept = memory.Memory(shape=corner(self.config), depth=depth, init=[], attrs=BLOCK_RAM)
        m.submodules[name] = kept
        write, of = kept.write_port(), kept.read_port()
        m.d.comb += [
            write.en.eq(en),
            write.addr.eq(Cat(written, word.tag.packet)),
            write.data.eq(word.word),
            of.addr.eq(Cat(read, self.packet)),
        ]
        return of.data

    def _instances(self, m: Module, complete: Value, packet: Value, triangle: Value):
        """Packets at instances go another way, and there are roots."""
        word, packets = self.i_words.p, self.config.packets
        record = data.View(records.TRIANGLE, word.word[: records.TRIANGLE.size])
        row = data.View(records.row(self.config.fmt), word.word)
        at_instance = Signal(packets)
        with m.If(self.i_words.valid & (word.tag.part == RECORD)):
            m.d.sync += at_instance.bit_select(word.tag.packet, 1).eq(record.is_instance)
        m.submodules.instances = ready = fifo.SyncFIFO(width=len(packet), depth=packets)
        m.submodules.roots = roots = memory.Memory(
            shape=self.config.pointer_bits, depth=packets, init=[]
        )
        write, read = roots.write_port(), roots.read_port()
        here = at_instance.bit_select(packet, 1)
        m.d.comb += [
            triangle.eq(complete & ~here),
            ready.w_en.eq(complete & here),
            ready.w_data.eq(packet),
            self.o_instances.valid.eq(ready.r_rdy),
            self.o_instances.p.eq(ready.r_data),
            ready.r_en.eq(self.o_instances.ready),
            write.en.eq(self.i_words.valid & (word.tag.part == 0)),
            write.addr.eq(word.tag.packet),
            write.data.eq(row.root),
            read.addr.eq(self.packet),
            self.root.eq(read.data),
        ]
