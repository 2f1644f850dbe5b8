"""Brings the corners of triangles from memory, and the rows of instances."""

from amaranth import *
from amaranth.lib import data, fifo, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.fp.format import FloatFormat
from hdl.rays.banks import BLOCK_RAM
from hdl.rays.packet import AXES, packet_bits

CORNERS = ("v0", "v1", "v2")
RECORD = len(CORNERS)
"""The part of the leaf's record; those below it are its corners or rows."""


def tag(config: Config) -> data.StructLayout:
    """What a word is for: the triangle that a packet meets, and which part of it."""
    return data.StructLayout({"packet": packet_bits(config), "part": range(RECORD + 1)})


def read(config: Config) -> data.StructLayout:
    """A word to read, from an address in words."""
    return data.StructLayout({"tag": tag(config), "address": config.address_bits})


def word(config: Config) -> data.StructLayout:
    """A word that was read."""
    return data.StructLayout({"tag": tag(config), "word": records.word_bits(config.fmt)})


def corners(config: Config) -> data.StructLayout:
    """The corners of a triangle; where there are instances, or the rows of one."""
    kept = row(config.fmt) if config.instances else records.vertex(config.fmt)
    return data.StructLayout(dict.fromkeys(CORNERS, kept))


def row(fmt: FloatFormat) -> data.StructLayout:
    """A row of an instance; x, y and z are where they are in a vertex."""
    return data.StructLayout(dict.fromkeys((*AXES, "offset"), fmt.layout))


class Corners(wiring.Component):
    """Reads a triangle's record and then its vertices, for as many packets as there are.

    Likewise of an instance, which has rows where a triangle has vertices. Triangles and instances
    do not wait for each other.

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
    o : Out(stream of packets), as the corners of their triangles are there
    o_instances : Out(stream of packets), as the rows of their instances are; where there are such
    packet : In(packet)
    corners : Out(corners), of the packet one cycle ago
    root : Out(node), of its instance; where there are such
    """

    triangles: Signal
    vertices: Signal
    i: stream.Interface
    o_reads: stream.Interface
    i_words: stream.Interface
    o: stream.Interface
    o_instances: stream.Interface
    packet: Signal
    corners: data.View
    root: Signal

    def __init__(self, config: Config):
        self.config = config
        packet = packet_bits(config)
        self.test = data.StructLayout({"packet": packet, "triangle": config.pointer_bits})
        instances = {
            "o_instances": Out(stream.Signature(packet)),
            "root": Out(config.pointer_bits),
        }
        super().__init__({
            "triangles": In(config.address_bits),
            "vertices": In(config.address_bits),
            "i": In(stream.Signature(self.test)),
            "o_reads": Out(stream.Signature(read(config))),
            "i_words": In(stream.Signature(word(config), always_ready=True)),
            "o": Out(stream.Signature(packet)),
            "packet": In(packet),
            "corners": Out(corners(config)),
            **(instances if config.instances else {}),
        })

    def elaborate(self, platform):
        m = Module()

        packets, word = self.config.packets, self.i_words.p
        indices = data.StructLayout(dict.fromkeys(CORNERS, records.INDEX_BITS))
        record = data.StructLayout({"packet": len(self.packet), "vertices": indices})
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
            self._instances(m, complete, packet, ready)
        with m.If(is_corner):
            m.d.sync += there[word.tag.packet].bit_select(word.tag.part, 1).eq(1)
        with m.If(complete):
            m.d.sync += there[packet].eq(0)
        for index, corner in enumerate(CORNERS):
            kept = memory.Memory(
                shape=self.corners[corner].shape(), depth=packets, init=[], attrs=BLOCK_RAM
            )
            m.submodules[corner] = kept
            write, of = kept.write_port(), kept.read_port()
            m.d.comb += [
                write.en.eq(self.i_words.valid & (word.tag.part == index)),
                write.addr.eq(word.tag.packet),
                write.data.eq(word.word),
                of.addr.eq(self.packet),
                self.corners[corner].eq(of.data),
            ]
        return m

    def _instances(self, m: Module, complete: Value, packet: Value, ready: fifo.SyncFIFO):
        """Packets at instances have a queue of their own; the root of each is kept."""
        packets, word = self.config.packets, self.i_words.p
        leaf = data.View(records.TRIANGLE, word.word[: records.TRIANGLE.size])
        are = Signal(packets)  # at an instance
        with m.If(self.i_words.valid & (word.tag.part == RECORD)):
            m.d.sync += are.bit_select(word.tag.packet, 1).eq(leaf.is_instance)
        entering, out = Signal(), self.o_instances
        m.submodules.instances = queue = fifo.SyncFIFO(width=len(packet), depth=packets)
        m.d.comb += [
            entering.eq(are.bit_select(packet, 1)),
            ready.w_en.eq(complete & ~entering),
            queue.w_en.eq(complete & entering),
            queue.w_data.eq(packet),
            out.valid.eq(queue.r_rdy),
            out.payload.eq(queue.r_data),
            queue.r_en.eq(out.ready),
        ]
        m.submodules.roots = roots = memory.Memory(
            shape=self.root.shape(), depth=packets, init=[], attrs=BLOCK_RAM
        )
        write, of = roots.write_port(), roots.read_port()
        m.d.comb += [
            write.en.eq(self.i_words.valid & (word.tag.part == 0)),
            write.addr.eq(word.tag.packet),
            write.data.eq(data.View(records.row(self.config.fmt), word.word).root),
            of.addr.eq(self.packet),
            self.root.eq(of.data),
        ]
