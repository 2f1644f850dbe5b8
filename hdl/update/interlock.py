"""Which instructions have to wait for what the ones before them make."""

from itertools import pairwise

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.isa import INSTRUCTION_BITS, LAYOUTS, REGISTER_BITS, Opcode

MERGE = data.StructLayout({"valid": 1, "b": REGISTER_BITS})


class Interlock(wiring.Component):
    """Knows the registers that are being written, and the instructions that want them.

    To look an operand up takes long: it is done for the instruction that comes next, and what was
    found is kept up to date while that waits. A vertex register can be read one cycle after
    `loaded`, a box register `config.box_latency` cycles after the merge that writes it.

    Parameters
    ----------
    config : Config

    Members
    -------
    next : In(instruction), that is here in the next cycle if this one steps
    here : In(instruction), that goes or waits
    valid : In(1), there is one here
    step : In(1), none stays here
    loaded : In(stream of registers), taken at once
    load, merge3, merge2 : Out(1), the one here, if it is such a one, has to wait
    """

    next: Signal
    here: Signal
    valid: Signal
    step: Signal
    loaded: stream.Interface
    load: Signal
    merge3: Signal
    merge2: Signal

    def __init__(self, config: Config):
        self.config = config
        super().__init__({
            **dict.fromkeys(("next", "here"), In(INSTRUCTION_BITS)),
            **dict.fromkeys(("valid", "step"), In(1)),
            "loaded": In(stream.Signature(REGISTER_BITS, always_ready=True)),
            **dict.fromkeys(("load", "merge3", "merge2"), Out(1)),
        })

    def elaborate(self, platform):
        m = Module()

        load, merge3, _ = _fields(self.here)
        next_load, next_merge3, next_merge2 = _fields(self.next)
        loaded = self.loaded

        # Vertex registers that a load will write, and whether those that the one here names are.
        loading = Signal(self.config.vertex_registers)
        busy = Signal(4)
        m.d.comb += [self.load.eq(busy[0]), self.merge3.eq(busy[1:].any())]
        loads = self.valid & (load.opcode == Opcode.LOAD)
        with m.If(loaded.valid):
            m.d.sync += loading.bit_select(loaded.payload, 1).eq(0)
        with m.If(loads & ~self.load):  # it may still wait for the port, but nothing before it does
            m.d.sync += loading.bit_select(load.v, 1).eq(1)
        for flag, now, new in zip(
            busy, _vertices(load, merge3), _vertices(next_load, next_merge3), strict=True
        ):
            with m.If(self.step):
                wanted = loading.bit_select(new, 1) | (loads & (load.v == new))
                m.d.sync += flag.eq(wanted & ~(loaded.valid & (loaded.payload == new)))
            with m.Elif(loaded.valid & (loaded.payload == now)):
                m.d.sync += flag.eq(0)

        # Merges, the youngest first: the one here, that goes if another one comes, and those before
        # it. The one that comes waits for each that writes its boxes; a bit is a cycle to wait.
        merges = [Signal(MERGE, name=f"merge_{age}") for age in range(self.config.box_latency - 1)]
        merges_here = (merge3.opcode == Opcode.MERGE3) | (merge3.opcode == Opcode.MERGE2)
        m.d.comb += [
            merges[0].valid.eq(self.valid & merges_here),
            merges[0].b.eq(merge3.b),  # the same bits in MERGE2
        ]
        m.d.sync += [old.eq(new) for new, old in pairwise(merges)]
        waits = Signal(len(merges))
        m.d.comb += self.merge2.eq(waits[0])
        m.d.sync += waits.eq(waits >> 1)
        with m.If(self.step):
            m.d.sync += waits.eq(0)
            for cycles, merge in enumerate(reversed(merges), 1):
                b0, b1 = next_merge2.b0, next_merge2.b1
                with m.If(merge.valid & ((merge.b == b0) | (merge.b == b1))):
                    m.d.sync += waits.eq((1 << cycles) - 1)
        return m


def _fields(word: Value) -> list[data.View]:
    """A word as LOAD, MERGE3 and MERGE2."""
    kinds = Opcode.LOAD, Opcode.MERGE3, Opcode.MERGE2
    return [data.View(LAYOUTS[kind], word[: LAYOUTS[kind].size]) for kind in kinds]


def _vertices(load: data.View, merge3: data.View) -> list[Value]:
    """Vertex registers that a word may name."""
    return [load.v, merge3.v0, merge3.v1, merge3.v2]
