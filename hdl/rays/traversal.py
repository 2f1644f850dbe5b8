"""The traversal unit: packets of four rays through a B-KD tree."""

from amaranth import *
from amaranth.lib import data, fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.rays.packet import RAYS, level, packet_bits
from hdl.rays.queue import Queue
from hdl.rays.stack import Stack, start, tested
from hdl.rays.step import Step, node_word, setup

COUNTERS = data.StructLayout({"steps": 32, "tests": 32, "pushes": 32, "pops": 32})
"""Packets at nodes, packets at triangles, entries put on stacks and taken off."""


class Traversal(wiring.Component):
    """Takes packets from the root to the triangles that their rays may hit, the nearest first.

    One packet step a cycle, of four rays and both children, while nodes come and packets are
    ready; a folded one takes a step every second cycle. From a node to the request of the next one
    it takes `latency` cycles if no other is before it, and where a packet has to pop
    `Stack.latency` + 1 more for each entry looked at. (Woop, Marmitt, Slusallek, "B-KD Trees for
    Hardware Accelerated Ray Tracing of Dynamic Scenes", Graphics Hardware 2006.)

    A packet is set up on all axes, then starts; its number is free again when it is done. Each
    request for a node or a test has one answer; packets are answered in any order.

    Parameters
    ----------
    config : Config

    Members
    -------
    root : In(node), constant while packets are under way
    clear : In(1), counters start again
    i_setup : In(stream of setup), taken at once
    i_start : In(stream of start)
    o_nodes : Out(stream of {packet, level, node}); level where there are instances
    i_nodes : In(stream of node_word), taken at once
    o_tests : Out(stream of {packet, level, triangle, mask: rays that may hit it}); likewise
    i_tests : In(stream of tested)
    o_done : Out(stream of packets)
    overflow : Out(1), a number has become infinite
    counters : Out(COUNTERS)

    Attributes
    ----------
    latency : int
    """

    root: Signal
    clear: Signal
    i_setup: stream.Interface
    i_start: stream.Interface
    o_nodes: stream.Interface
    i_nodes: stream.Interface
    o_tests: stream.Interface
    i_tests: stream.Interface
    o_done: stream.Interface
    overflow: Signal
    counters: data.View

    def __init__(self, config: Config):
        self.config = config
        self.step = Step(config)
        self.latency = self.step.latency + Queue.latency + config.folded
        packet, pointer = packet_bits(config), config.pointer_bits
        node = data.StructLayout({"packet": packet, **level(config), "node": pointer})
        test = {"packet": packet, **level(config), "triangle": pointer, "mask": RAYS}
        super().__init__({
            "root": In(pointer),
            "clear": In(1),
            "i_setup": In(stream.Signature(setup(config), always_ready=True)),
            "i_start": In(stream.Signature(start(config))),
            "o_nodes": Out(stream.Signature(node)),
            "i_nodes": In(stream.Signature(node_word(config), always_ready=True)),
            "o_tests": Out(stream.Signature(data.StructLayout(test))),
            "i_tests": In(stream.Signature(tested(config))),
            "o_done": Out(stream.Signature(packet)),
            "overflow": Out(1),
            "counters": Out(COUNTERS),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.step = step = self.step
        m.submodules.stack = stack = Stack(self.config)
        m.d.comb += [stack.root.eq(self.root), self.overflow.eq(step.overflow)]
        for outer, inner in [
            (self.i_setup, step.i_setup),
            (self.i_start, stack.i_start),
            (self.i_tests, stack.i_tests),
            (self.o_done, stack.o_done),
        ]:
            wiring.connect(m, wiring.flipped(outer), inner)
        wiring.connect(m, step.o_pops, stack.i_pops)
        wiring.connect(m, step.o_pushes, stack.i_pushes)
        wiring.connect(m, step.o_visits, stack.i_visits)
        wiring.connect(m, stack.o_visits, step.i_visits)

        packets = self.config.packets
        if not self.config.folded:
            wiring.connect(m, wiring.flipped(self.i_nodes), step.i)
        else:  # each packet waits for one node at most
            m.submodules.words = words = fifo.SyncFIFO(
                width=len(self.i_nodes.p.as_value()), depth=packets
            )
            m.d.comb += [
                words.w_en.eq(self.i_nodes.valid),
                words.w_data.eq(self.i_nodes.p),
                step.i.valid.eq(words.r_en & words.r_rdy),
                step.i.p.eq(words.r_data),
            ]
            m.d.sync += words.r_en.eq(~step.i.valid)

        # Visits are of nodes and of triangles.
        m.submodules.nodes = nodes = Queue(self.o_nodes.p.shape(), packets)
        m.submodules.tests = tests = Queue(self.o_tests.p.shape(), packets)
        wiring.connect(m, wiring.flipped(self.o_nodes), nodes.o)
        wiring.connect(m, wiring.flipped(self.o_tests), tests.o)
        for to_node, to_test, visit in zip(
            nodes.i, tests.i, (step.o_visits, stack.o_visits), strict=True
        ):
            m.d.comb += [
                to_node.valid.eq(visit.valid & ~visit.p.is_leaf),
                to_node.p.packet.eq(visit.p.packet),
                to_node.p.node.eq(visit.p.child),
                to_test.valid.eq(visit.valid & visit.p.is_leaf),
                to_test.p.packet.eq(visit.p.packet),
                to_test.p.triangle.eq(visit.p.child),
                to_test.p.mask.eq(visit.p.mask),
                *(
                    to.p[name].eq(visit.p[name])
                    for name in level(self.config)
                    for to in (to_node, to_test)
                ),
            ]

        for name, event in [
            ("steps", self.i_nodes.valid),
            ("tests", self.o_tests.valid & self.o_tests.ready),
            ("pushes", step.o_pushes.valid),
            ("pops", stack.popped),
        ]:
            count = self.counters[name]
            m.d.sync += count.eq(Mux(self.clear, 0, count + event))
        return m
