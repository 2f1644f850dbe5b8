"""Where packets are, and so what a cycle without a step waits for."""

from amaranth import *
from amaranth.lib import data, enum, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config


class Wait(enum.Enum, shape=2):
    """What a cycle without a step waits for.

    NODES : nodes from memory
    TESTS : triangle tests, with the corners that they read; and ways into objects
    LOOP : the stages between a node and the request of the next one, stacks among them
    RAYS : rays, until they are prepared
    """

    NODES = 0
    TESTS = 1
    LOOP = 2
    RAYS = 3


COUNTERS = data.StructLayout({wait.name.lower(): 32 for wait in Wait})
"""Cycles without a step, by what most packets are at."""


class Census(wiring.Component):
    """Counts packets by place, and cycles without a step by what most packets are at.

    Parameters
    ----------
    config : Config

    Members
    -------
    counts : In(1), a cycle of the run
    clear : In(1), counters start again
    started, done : In(1), a packet enters the loop, and leaves it for good
    asks_node, has_node, asks_test, has_test : In(1), a packet leaves the loop for a while
    enters : In(1), one comes back from a test into an object; where there are instances
    counters : Out(COUNTERS), of all but the last cycle
    """

    counts: Signal
    clear: Signal
    started: Signal
    done: Signal
    asks_node: Signal
    has_node: Signal
    asks_test: Signal
    has_test: Signal
    enters: Signal
    counters: data.View

    def __init__(self, config: Config):
        self.config = config
        events = ["started", "done", "asks_node", "has_node", "asks_test", "has_test"]
        if config.instances:
            events.append("enters")
        super().__init__({
            **dict.fromkeys(("counts", "clear", *events), In(1)),
            "counters": Out(COUNTERS),
        })

    def elaborate(self, platform):
        m = Module()

        packets = self.config.packets
        back = self.has_test + self.enters if self.config.instances else self.has_test
        nodes, tests, walking = (
            Signal(range(packets + 1), name=name) for name in ("nodes", "tests", "walking")
        )
        m.d.sync += [
            nodes.eq(nodes + self.asks_node - self.has_node),
            tests.eq(tests + self.asks_test - back),
            walking.eq(walking + self.started - self.done),
        ]
        loop, rays = (Signal.like(walking, name=name) for name in ("loop", "rays"))
        m.d.comb += [loop.eq(walking - nodes - tests), rays.eq(packets - walking)]

        wait = Signal(Wait)
        with m.If((nodes >= tests) & (nodes >= loop) & (nodes >= rays)):
            m.d.comb += wait.eq(Wait.NODES)
        with m.Elif((tests >= loop) & (tests >= rays)):
            m.d.comb += wait.eq(Wait.TESTS)
        with m.Elif(loop >= rays):
            m.d.comb += wait.eq(Wait.LOOP)
        with m.Else():
            m.d.comb += wait.eq(Wait.RAYS)

        # It is known late in its cycle, and counted in the next one.
        waited, counts = Signal(Wait, reset_less=True), Signal()
        m.d.sync += [waited.eq(wait), counts.eq(self.counts & ~self.has_node)]
        with m.If(self.clear):
            m.d.sync += self.counters.eq(0)
        with m.Elif(counts), m.Switch(waited):
            for cause in Wait:
                count = self.counters[cause.name.lower()]
                with m.Case(cause):
                    m.d.sync += count.eq(count + 1)
        return m
