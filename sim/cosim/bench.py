"""The design under test: a unit that runs jobs and a memory model, in one Verilog."""

from pathlib import Path
from typing import Protocol

from amaranth import *
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.config import Config
from hdl.memory.port import Port, PortInterface
from hdl.records import word_bits

MEMORY_MODEL = Path(__file__).parent / "memory_model.v"


class Unit(Protocol):
    """A component that takes jobs, is busy, counts, and reaches memory by ports."""

    config: Config
    i: stream.Interface
    busy: Signal
    counters: data.View

    @property
    def signature(self) -> wiring.Signature: ...

    def elaborate(self, platform) -> Module: ...


class Bench(wiring.Component):
    """A unit on a memory model, so that no one wakes Python in the middle of a run.

    Parameters
    ----------
    unit : Unit
    words : int
        Size of the memory in words.

    Members
    -------
    i, busy, counters :
        As in the unit.
    latency, stall, seed, load, dump, first, last, outside :
        As in memory_model.v.
    """

    i: stream.Interface
    busy: Signal
    counters: data.View
    outside: Signal

    def __init__(self, unit: Unit, words: int):
        config = unit.config
        if not 1 <= words <= 1 << config.address_bits:
            raise ValueError(f"{words} words do not fit {config.address_bits} address bits")
        self.unit = unit
        self.config = config
        self.words = words
        super().__init__({
            "i": In(stream.Signature(unit.i.payload.shape())),
            "busy": Out(1),
            "counters": Out(unit.counters.shape()),
            "latency": In(10),
            "stall": In(16),
            "seed": In(32),
            "load": In(1),
            "dump": In(1),
            "first": In(config.address_bits),
            "last": In(config.address_bits),
            "outside": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.unit = unit = self.unit
        wiring.connect(m, wiring.flipped(self.i), unit.i)
        m.d.comb += [self.busy.eq(unit.busy), self.counters.eq(unit.counters)]
        ports: list[PortInterface] = [
            getattr(unit, name)
            for name, member in unit.signature.members.items()
            if member.is_signature and isinstance(member.signature, Port)
        ]
        requests, responses = [p.request for p in ports], [p.response for p in ports]
        request_ready, response_valid = Signal(len(ports)), Signal(len(ports))
        response_data = Signal(len(ports) * word_bits(self.config.fmt))
        m.d.comb += [
            Cat(request.ready for request in requests).eq(request_ready),
            Cat(response.valid for response in responses).eq(response_valid),
            Cat(response.payload for response in responses).eq(response_data),
        ]
        m.submodules.memory = Instance(
            "memory_model",
            p_ADDRESS_BITS=self.config.address_bits,
            p_WORD_BITS=word_bits(self.config.fmt),
            p_PORTS=len(ports),
            p_SIZE=self.words,
            i_clk=ClockSignal(),
            i_rst=ResetSignal(),
            i_request_valid=Cat(request.valid for request in requests),
            o_request_ready=request_ready,
            i_request_address=Cat(request.p.address for request in requests),
            i_request_write=Cat(request.p.write for request in requests),
            i_request_mask=Cat(request.p.mask for request in requests),
            i_request_data=Cat(request.p.data for request in requests),
            o_response_valid=response_valid,
            o_response_data=response_data,
            **{f"i_{k}": getattr(self, k) for k in ("latency", "stall", "seed")},
            **{f"i_{k}": getattr(self, k) for k in ("load", "dump", "first", "last")},
            o_outside=self.outside,
        )
        return m
