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
    return numbered(config, {**level(config), "axis": 2, "ray": slab_ray(config.fmt)})


def node_word(config: Config) -> data.StructLayout:
    """A node that a packet asked for."""
    word = records.node(config.fmt)
    return data.StructLayout({"packet": packet_bits(config), **level(config), "word": word})


class Step(wiring.Component):
    """Clips the rays of a packet against both children of its node, and decides.

    A child that no ray reaches is left out. Of two, the one goes first that the first ray in both
    enters first: the left one, if equal or if no ray is in both. Nothing here waits. Takes
    `latency` cycles; one step a cycle. A folded one has the planes of one child, which both take in
    turn: a cycle more, and a step every second cycle at most.

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

    Attributes
    ----------
    latency : int
    """

    i_setup: stream.Interface
    i_visits: stream.Interface
    i: stream.Interface
    o_visits: stream.Interface
    o_pushes: stream.Interface
    o_pops: stream.Interface
    overflow: Signal

    def __init__(self, config: Config):
        self.config = config
        self.latency = Planes.latency + (6 if config.folded else 5)
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
        clip = 2 + Planes.latency  # the stage, of the left child where each has its turn
        packets = 1 << packet_bits(self.config)
        at_once = not self.config.folded  # both children

        valid = Signal(self.latency - 1)
        packet = [self.i.p.packet] + [
            Signal(packet_bits(self.config), name=f"packet_{k}", reset_less=True)
            for k in range(1, self.latency)
        ]
        m.d.sync += valid.eq(Cat(self.i.valid, valid))
        m.d.sync += [later.eq(now) for now, later in zip(packet, packet[1:], strict=False)]

        # stages 0 and 1: read the rays on the node's axis, those of the node's level
        levels = len(level(self.config))
        place, wanted = (Cat(of.packet, of.level if levels else ()) for of in (i_setup.p, self.i.p))
        m.submodules.rays = rays = memory.Memory(
            shape=data.ArrayLayout(slab_ray(fmt), RAYS), depth=3 * packets << levels, init=[]
        )
        write, read = rays.write_port(granularity=1), rays.read_port()
        bounds, bounds2 = (
            Signal(records.bounds(fmt), name=f"bounds_{k}", reset_less=True) for k in (1, 2)
        )
        rays2 = Signal.like(read.data, reset_less=True)
        m.d.comb += [
            write.en.eq(Cat(i_setup.valid & (i_setup.p.number == k) for k in range(RAYS))),
            write.addr.eq(Cat(place, i_setup.p.axis)),
            *(lane.eq(i_setup.p.ray) for lane in write.data),
            read.addr.eq(Cat(wanted, node.axis)),
        ]
        m.d.sync += bounds2.eq(bounds)
        with m.If(self.i.valid | at_once):  # for both turns
            m.d.sync += bounds.eq(node.bounds)
        with m.If(valid[0] | at_once):
            m.d.sync += rays2.eq(read.data)

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
        with m.If(valid[clip - 2] | at_once):
            m.d.sync += [now.eq(visits.value), link.eq(read.data)]

        # stages 2 to clip: where the rays meet the planes; stage clip: clip
        slabs = {side: [bounds2[f"{side}_{end}"] for end in ("lo", "hi")] for side in SIDES}
        if at_once:
            comes = valid[1]
        else:
            comes = valid[1] | valid[2]
            ends = zip(slabs["right"], slabs["left"], strict=True)
            slabs = {"child": [Mux(valid[2], *of) for of in ends]}
        clips = [self._clip(m, of, comes, slabs[of], rays2, now.intervals) for of in slabs]
        m.d.sync += self.overflow.eq(Cat(overflows for _, overflows in clips).any())

        # the stage after it: who is where?
        children = [
            [Signal(self.visit, name=f"{side}_{k}", reset_less=True) for k in (1, 2)]
            for side in SIDES
        ]
        depth = Signal.like(now.depth, reset_less=True)
        for side, (child1, child2) in enumerate(children):
            clipped, _ = clips[side % len(clips)]
            with m.If(at_once or valid[clip - 1 + side]):
                for after, (near, far) in zip(child1.intervals, clipped, strict=True):
                    m.d.sync += [after.near.eq(near), after.far.eq(far)]
            m.d.sync += [
                child1.is_leaf.eq(link.leaves[side]),
                child1.depth.eq(now.depth + 1),
                *(child1[name].eq(now[name]) for name in level(self.config)),
                child2.eq(child1),
                *(
                    child2.mask[ray].eq(~less(after.far, after.near))
                    for ray, after in enumerate(child1.intervals)
                ),
            ]
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

    def _clip(
        self,
        m: Module,
        child: str,
        comes: Value,
        slab: list[Value],
        rays: data.View,
        before: data.View,
    ) -> tuple[list[tuple[Value, Value]], Signal]:
        """The intervals of four rays within a slab, and which of them overflowed a cycle ago."""
        clipped, overflows = [], Signal(RAYS, name=f"{child}_overflows")
        for k in range(RAYS):
            m.submodules[f"{child}_{k}"] = planes = Planes(self.config.fmt)
            m.d.comb += [
                planes.i.valid.eq(comes),
                planes.i.p.low.eq(slab[0]),
                planes.i.p.high.eq(slab[1]),
                planes.i.p.ray.eq(rays[k]),
                planes.o.ready.eq(1),
            ]
            m.d.sync += overflows[k].eq(planes.overflow)
            begin, end, was = planes.o.p.begin, planes.o.p.end, before[k]
            near = Mux(less(was.near, begin), begin, was.near)
            far = Mux(less(end, was.far), end, was.far)
            clipped.append((near, far))
        return clipped, overflows
