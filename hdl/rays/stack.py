"""The stacks of all packets: children that wait, and which of them is visited next."""

from amaranth import *
from amaranth.lib import data, fifo, memory, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import bits_for

from hdl.config import Config
from hdl.fp.order import less
from hdl.rays.banks import Banks
from hdl.rays.packet import RAYS, interval, level, packet_bits


def visit(config: Config) -> data.StructLayout:
    """A packet at a child of a node.

    depth : entries of its stack
    mask : rays that reach the child
    child : a node, or a triangle where is_leaf
    level : see hdl.rays.packet.level; it goes along with an entry
    intervals : of the rays in the child; empty for those that do not reach it
    """
    return data.StructLayout({
        "packet": packet_bits(config),
        "depth": range(config.stack_depth + 1),
        "mask": RAYS,
        "child": config.pointer_bits,
        "is_leaf": 1,
        **level(config),
        "intervals": data.ArrayLayout(interval(config.fmt), RAYS),
    })


def start(config: Config) -> data.StructLayout:
    """A packet that is to begin, or where `level` is 1 to enter an object."""
    intervals = data.ArrayLayout(interval(config.fmt), RAYS)
    return data.StructLayout({
        "packet": packet_bits(config),
        **level(config),
        "intervals": intervals,
    })


def object_root(config: Config) -> data.StructLayout:
    """The object that a packet enters next: the root of its tree."""
    return data.StructLayout({"packet": packet_bits(config), "root": config.pointer_bits})


def leaf_test(config: Config) -> data.StructLayout:
    """A packet at a leaf. mask : rays that may hit it, one at least."""
    return data.StructLayout({
        "packet": packet_bits(config),
        "triangle": config.pointer_bits,
        "mask": RAYS,
        **level(config),
    })


def tested(config: Config) -> data.StructLayout:
    """A packet that is through with a triangle. t : least of the hits of each ray so far."""
    t = data.ArrayLayout(config.fmt.layout, RAYS)
    return data.StructLayout({"packet": packet_bits(config), "t": t})


class Stack(wiring.Component):
    """Says where packets go next that come from a triangle, from a dead end or from outside.

    A packet from outside goes to the root, one that enters an object to the root of that, on top
    of its stack. Any other one goes to the top entry of its stack that one of its rays still
    reaches; entries above that one are dropped. Each far is cut to the best t, here and nowhere
    else: only a test lowers best, and after it comes a pop.

    Takes `latency` cycles for each entry looked at, one for different packets each cycle.

    Parameters
    ----------
    config : Config

    Members
    -------
    root : In(node)
    i_start : In(stream of start)
    i_roots : In(stream of object_root), before the start of the packet; taken at once; where there
        are instances
    i_tests : In(stream of tested), at most a cycle in `latency` waits
    i_pops : In(stream of visit), of which packet and depth count; taken at once
    i_pushes : In(stream of visit), to the entry `depth`; taken at once
    i_visits : In(stream of visit), where packets went otherwise; taken at once
    o_visits : Out(stream of visit), taken at once
    o_done : Out(stream of packets) that are through
    popped : Out(1), an entry was taken off
    """

    latency = 5
    root: Signal
    i_start: stream.Interface
    i_roots: stream.Interface
    i_tests: stream.Interface
    i_pops: stream.Interface
    i_pushes: stream.Interface
    i_visits: stream.Interface
    o_visits: stream.Interface
    o_done: stream.Interface
    popped: Signal

    def __init__(self, config: Config):
        self.config = config
        self.visit = visit(config)
        visits = stream.Signature(self.visit, always_ready=True)
        roots = In(stream.Signature(object_root(config), always_ready=True))
        super().__init__({
            "root": In(config.pointer_bits),
            "i_start": In(stream.Signature(start(config))),
            **({"i_roots": roots} if config.instances else {}),
            "i_tests": In(stream.Signature(tested(config))),
            "i_pops": In(visits),
            "i_pushes": In(visits),
            "i_visits": In(visits),
            "o_visits": Out(visits),
            "o_done": Out(stream.Signature(packet_bits(config))),
            "popped": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        config, starts, tests, o = self.config, self.i_start, self.i_tests, self.o_visits
        packets = 1 << packet_bits(config)
        slot_bits = bits_for(config.stack_depth - 1)

        def slot(visit):  # there is no entry 0: the last one may have its place
            return Cat(visit.depth[:slot_bits], visit.packet)

        m.submodules.stack = stack = memory.Memory(
            shape=self.visit, depth=packets << slot_bits, init=[]
        )
        m.submodules.best = best = memory.Memory(shape=tests.p.t.shape(), depth=packets, init=[])
        m.submodules.depths = depths = Banks(self.visit["depth"].shape, packets)
        push, top = stack.write_port(), stack.read_port()
        new_best, old_best = best.write_port(), best.read_port()
        m.d.comb += [
            push.en.eq(self.i_pushes.valid),
            push.addr.eq(slot(self.i_pushes.p)),
            push.data.eq(self.i_pushes.p),
        ]
        for write, visit in zip(depths.i, (self.i_visits, o), strict=True):
            m.d.comb += [
                write.valid.eq(visit.valid),
                write.p.row.eq(visit.p.packet),
                write.p.value.eq(visit.p.depth),
            ]

        # `there`: there is an entry, or a root; `more`: entries, after what is taken off; `enters`:
        # the root is that of an object.
        flags = {"valid": 1, "starts": 1, "tested": 1, "there": 1, "more": 1}
        if config.instances:
            flags["enters"] = 1
        about = data.StructLayout(
            flags | {field: self.visit[field].shape for field in ("packet", "depth")}
        )
        stages = [Signal(about, name=f"s{k}") for k in range(self.latency + 1)]
        s0, s1, s2, s3, s4, s5 = stages
        m.d.sync += [later.eq(s) for s, later in zip(stages, stages[1:], strict=False)]

        # stage 0: choose
        m.submodules.pops = pops = fifo.SyncFIFO(width=len(s0.as_value()), depth=config.packets)
        waiting = data.View(about, pops.r_data)
        again = Signal()
        m.d.comb += [
            pops.w_en.eq(self.i_pops.valid),
            pops.w_data.eq(Cat(C(1, len(flags)), self.i_pops.p.packet, self.i_pops.p.depth)),
            tests.ready.eq(~again),
            depths.row.eq(tests.p.packet),
        ]
        if config.instances:
            with m.If(~tests.valid):
                m.d.comb += depths.row.eq(starts.p.packet)
        with m.If(again):
            m.d.comb += [s0.valid.eq(1), s0.packet.eq(s5.packet), s0.depth.eq(s5.depth)]
        with m.Elif(tests.valid):
            m.d.comb += [s0.valid.eq(1), s0.packet.eq(tests.p.packet), s0.tested.eq(1)]
        with m.Elif(pops.r_rdy):
            m.d.comb += [s0.eq(waiting), pops.r_en.eq(1)]
        with m.Elif(starts.valid & ~s1.starts & ~s2.starts):  # it stays until stage 2
            m.d.comb += [s0.valid.eq(1), s0.packet.eq(starts.p.packet), s0.starts.eq(1)]
            if config.instances:
                m.d.comb += s0.enters.eq(starts.p.level)
        best1 = Signal.like(new_best.data, reset_less=True)
        for ray in range(RAYS):
            far = starts.p.intervals[ray].far
            m.d.sync += best1[ray].eq(Mux(tests.valid, tests.p.t[ray], far))

        # stage 1: read the entry, write the best t
        m.d.comb += [
            top.addr.eq(slot(s1)),
            new_best.addr.eq(s1.packet),
            new_best.en.eq(s1.valid & (s1.tested | s1.starts)),
            new_best.data.eq(best1),
        ]
        with m.If(s1.tested):
            m.d.comb += top.addr.eq(Cat(depths.value[:slot_bits], s1.packet))
            m.d.sync += s2.depth.eq(depths.value)
        if config.instances:
            with m.If(s1.enters):
                m.d.comb += new_best.en.eq(0)
                m.d.sync += s2.depth.eq(depths.value)

        # stage 2: take off, read the best t
        entry3, entry4, entry5 = (
            Signal(self.visit, name=f"entry{k}", reset_less=True) for k in (3, 4, 5)
        )
        best3 = old_best.data
        m.d.comb += [starts.ready.eq(s2.valid & s2.starts), old_best.addr.eq(s2.packet)]
        m.d.sync += [
            s3.there.eq(s2.starts | s2.depth.any()),
            s3.depth.eq(s2.depth - s2.depth.any()),
            self.popped.eq(s2.valid & s2.depth.any()),
            entry3.eq(top.data),
        ]
        with m.If(s2.starts):
            m.d.sync += [
                entry3.child.eq(self.root),
                entry3.is_leaf.eq(0),
                entry3.intervals.eq(starts.p.intervals),
            ]
        if config.instances:
            self._enter(m, s1, s2, s3, entry3)

        # stage 3: cut far; stage 4: is anything left?
        m.d.sync += [entry4.eq(entry3), entry5.eq(entry4), s5.more.eq(s4.depth.any())]
        for ray in range(RAYS):
            with m.If(less(best3[ray], entry3.intervals[ray].far)):
                m.d.sync += entry4.intervals[ray].far.eq(best3[ray])
            near, far = entry4.intervals[ray].near, entry4.intervals[ray].far
            m.d.sync += entry5.mask[ray].eq(s4.there & ~less(far, near))

        # stage 5: go there, look at the next entry, or end
        found = entry5.mask.any()
        m.submodules.done = done = fifo.SyncFIFO(width=len(s5.packet), depth=config.packets)
        m.d.comb += [
            o.valid.eq(s5.valid & found),
            o.p.eq(entry5),
            o.p.packet.eq(s5.packet),
            o.p.depth.eq(s5.depth),
            again.eq(s5.valid & ~found & s5.more),
            done.w_en.eq(s5.valid & ~found & ~s5.more),
            done.w_data.eq(s5.packet),
            self.o_done.valid.eq(done.r_rdy),
            self.o_done.payload.eq(done.r_data),
            done.r_en.eq(self.o_done.ready),
        ]
        return m

    def _enter(self, m: Module, s1, s2, s3, entry3):
        """What is different of a packet that enters an object: it goes to the root of that."""
        m.submodules.roots = roots = memory.Memory(
            shape=self.i_roots.p.root.shape(), depth=1 << packet_bits(self.config), init=[]
        )
        write, root = roots.write_port(), roots.read_port()
        m.d.comb += [
            write.en.eq(self.i_roots.valid),
            write.addr.eq(self.i_roots.p.packet),
            write.data.eq(self.i_roots.p.root),
            root.addr.eq(s1.packet),
        ]
        with m.If(s2.starts):
            m.d.sync += entry3.level.eq(s2.enters)
        with m.If(s2.enters):
            m.d.sync += [
                entry3.child.eq(root.data),
                s3.depth.eq(s2.depth),
                self.popped.eq(0),
            ]
