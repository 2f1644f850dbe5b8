"""The packet step: four rays at a node, and what is to be visited next."""

from amaranth import *
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl import records
from hdl.config import Config
from hdl.fp.order import less
from hdl.rays.banks import BLOCK_RAM, Banks
from hdl.rays.packet import RAYS, level, numbered, packet_bits, slab_ray
from hdl.rays.planes import Planes
from hdl.rays.stack import visit

SIDES = ("left", "right")


def setup(config: Config) -> data.StructLayout:
    """A ray of a packet on an axis."""
    return numbered(config, {"axis": 2, **level(config), "ray": slab_ray(config.fmt)})


def node_word(config: Config) -> data.StructLayout:
    """A node that a packet asked for."""
    return data.StructLayout({"packet": packet_bits(config), "word": records.node(config.fmt)})


class Step(wiring.Component):
    """Clips the rays of a packet against both children of its node, and decides.

    A child that no ray reaches is left out. Of two, the one goes first that the first ray in both
    enters first: the left one, if equal or if no ray is in both. Nothing here waits. Takes
    `latency` cycles; one step a cycle. With instances it knows the rays of both levels, and which
    of them each packet is at.

    Parameters
    ----------
    config : Config

    Members
    -------
    i_setup : In(stream of setup), taken at once
    i_visits : In(stream of visit), where packets went otherwise; taken at once
    i : In(stream of node_word), of the packet's last visit; taken at once
    o_visits : Out(stream of visit), the child that goes first
    o_pushes : Out(stream of visit), the one that waits, as entry `depth` of the stack
    o_pops : Out(stream of visit), of a packet that reaches none; packet and depth count
    overflow : Out(1), a number has become infinite
    """

    latency = Planes.latency + 5
    i_setup: stream.Interface
    i_visits: stream.Interface
    i: stream.Interface
    o_visits: stream.Interface
    o_pushes: stream.Interface
    o_pops: stream.Interface
    overflow: Signal

    def __init__(self, config: Config):
        self.config = config
        self.visit = visit(config)
        visits = stream.Signature(self.visit, always_ready=True)
        super().__init__({
            "i_setup": In(stream.Signature(setup(config), always_ready=True)),
            "i_visits": In(visits),
            "i": In(stream.Signature(node_word(config), always_ready=True)),
            "o_visits": Out(visits),
            "o_pushes": Out(visits),
            "o_pops": Out(visits),
            "overflow": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        fmt, node, i_setup = self.config.fmt, self.i.p.word, self.i_setup
        clip = 2 + Planes.latency  # the stage
        packets = 1 << packet_bits(self.config)

        valid = Signal(self.latency - 1)
        packet = [self.i.p.packet] + [
            Signal(packet_bits(self.config), name=f"packet_{k}", reset_less=True)
            for k in range(1, self.latency)
        ]
        m.d.sync += valid.eq(Cat(self.i.valid, valid))
        m.d.sync += [later.eq(now) for now, later in zip(packet, packet[1:], strict=False)]

        # stages 0 and 1: read the rays on the node's axis
        m.submodules.rays = rays = memory.Memory(
            shape=data.ArrayLayout(slab_ray(fmt), RAYS),
            depth=3 * packets << self.config.instances,
            init=[],
        )
        write, read = rays.write_port(granularity=1), rays.read_port()
        of_setup, of_packet = self._levels(m, packets)
        bounds, bounds2 = (
            Signal(records.bounds(fmt), name=f"bounds_{k}", reset_less=True) for k in (1, 2)
        )
        rays2 = Signal.like(read.data, reset_less=True)
        m.d.comb += [
            write.en.eq(Cat(i_setup.valid & (i_setup.p.number == k) for k in range(RAYS))),
            write.addr.eq(Cat(i_setup.p.packet, *of_setup, i_setup.p.axis)),
            *(lane.eq(i_setup.p.ray) for lane in write.data),
            read.addr.eq(Cat(self.i.p.packet, *of_packet, node.axis)),
        ]
        m.d.sync += [bounds.eq(node.bounds), bounds2.eq(bounds), rays2.eq(read.data)]

        # What is not needed before the planes are done waits in memory.
        link_layout = data.StructLayout({"pointer": self.config.pointer_bits, "leaves": 2})
        m.submodules.links = links = memory.Memory(shape=link_layout, depth=packets, init=[])
        m.submodules.visits = visits = Banks(self.visit, packets, BLOCK_RAM)
        write, read = links.write_port(), links.read_port()
        m.d.comb += [
            write.en.eq(self.i.valid),
            write.addr.eq(self.i.p.packet),
            write.data.pointer.eq(node.pointer),
            write.data.leaves.eq(Cat(node.left_is_leaf, node.right_is_leaf)),
            read.addr.eq(packet[clip - 2]),
            visits.row.eq(packet[clip - 2]),
        ]
        for write, new in zip(visits.i, (self.o_visits, self.i_visits), strict=True):
            m.d.comb += [
                write.valid.eq(new.valid),
                write.p.row.eq(new.p.packet),
                write.p.value.eq(new.p),
            ]
        now, link = Signal(self.visit, reset_less=True), Signal(link_layout, reset_less=True)
        m.d.sync += [now.eq(visits.value), link.eq(read.data)]

        # stages 2 to clip: where the rays meet the planes; stage clip: clip
        children = [
            [Signal(self.visit, name=f"{side}_{k}", reset_less=True) for k in (1, 2)]
            for side in SIDES
        ]
        depth = Signal.like(now.depth, reset_less=True)
        overflows = Signal(len(SIDES) * RAYS)
        m.d.sync += self.overflow.eq(overflows.any())
        for side, (child, (child1, child2)) in enumerate(zip(SIDES, children, strict=True)):
            m.d.sync += [
                child1.is_leaf.eq(link.leaves[side]),
                child1.depth.eq(now.depth + 1),
                child2.eq(child1),
            ]
            if self.config.instances:
                m.d.sync += child1.level.eq(now.level)
            for ray in range(RAYS):
                m.submodules[f"{child}_{ray}"] = planes = Planes(fmt)
                m.d.comb += [
                    planes.i.valid.eq(valid[1]),
                    planes.i.p.low.eq(bounds2[f"{child}_lo"]),
                    planes.i.p.high.eq(bounds2[f"{child}_hi"]),
                    planes.i.p.ray.eq(rays2[ray]),
                    planes.o.ready.eq(1),
                ]
                m.d.sync += overflows[side * RAYS + ray].eq(planes.overflow)
                begin, end = planes.o.p.begin, planes.o.p.end
                before, after = now.intervals[ray], child1.intervals[ray]
                m.d.sync += [
                    after.near.eq(Mux(less(before.near, begin), begin, before.near)),
                    after.far.eq(Mux(less(end, before.far), end, before.far)),
                ]
                # the stage after it: who is where?
                m.d.sync += child2.mask[ray].eq(~less(after.far, after.near))
        (left1, left2), (right1, right2) = children
        both_leaves = link.leaves.all()
        m.d.sync += [
            depth.eq(now.depth),
            left1.child.eq(link.pointer),
            right1.child.eq(Mux(both_leaves, link.pointer + 1, now.child - 1)),
        ]
        left_is_nearer = Signal(RAYS, reset_less=True)
        for ray in range(RAYS):
            nears = right1.intervals[ray].near, left1.intervals[ray].near
            m.d.sync += left_is_nearer[ray].eq(~less(*nears))

        # the last stage: decide
        depth2 = Signal.like(depth, reset_less=True)
        both = left2.mask & right2.mask
        first = both & (~both + 1)[:RAYS]
        in_left, in_right = left2.mask.any(), right2.mask.any()
        to_right = ~in_left | (first & ~left_is_nearer).any()
        two = in_left & in_right
        m.d.sync += depth2.eq(depth)
        for to, of, other, when in [
            (self.o_visits, right2, left2, in_left | in_right),
            (self.o_pushes, left2, right2, two),
        ]:
            m.d.sync += [
                to.valid.eq(valid[-1] & when),
                to.p.eq(Mux(to_right, of, other)),
                to.p.packet.eq(packet[-1]),
            ]
        with m.If(~two):
            m.d.sync += self.o_visits.p.depth.eq(depth2)
        m.d.sync += [
            self.o_pops.valid.eq(valid[-1] & ~in_left & ~in_right),
            self.o_pops.p.packet.eq(packet[-1]),
            self.o_pops.p.depth.eq(depth2),
        ]
        return m

    def _levels(self, m: Module, packets: int) -> tuple[list[Value], list[Value]]:
        """Level of the ray that is set up, and of the packet whose node comes; where there are."""
        if not self.config.instances:
            return [], []
        visit = self.i_visits  # a packet changes its level elsewhere only
        levels = Signal(packets)
        with m.If(visit.valid):
            m.d.sync += levels.bit_select(visit.p.packet, 1).eq(visit.p.level)
        return [self.i_setup.p.level], [levels.bit_select(self.i.p.packet, 1)]
