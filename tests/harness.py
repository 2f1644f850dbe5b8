"""Runs components as Verilog under cocotb.

`SIM=icarus` chooses the simulator. `WAVES=1` keeps the waves, in FST files in the folder `waves`.
"""

import os
import shutil
from collections.abc import Callable
from pathlib import Path

from amaranth import Const, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from hdl.config import FULL, TINY, Config
from hdl.fp.format import FloatFormat
from sim.cosim import verilate

CONFIGS = {
    "smallest": Config(FloatFormat(2, 1), 3, 2, latency=1, address_bits=4, cache_words=16),
    "tiny": TINY,
    "odd": Config(FloatFormat(4, 8), 11, 7, latency=9, address_bits=13),  # half a byte unused
    "full": FULL,
    "wide": Config(FloatFormat(8, 23), 16, 9, latency=20, address_bits=14),  # 256-bit words
}


def waves_file(name: str) -> Path:
    """Where the waves of a test go."""
    Path("waves").mkdir(exist_ok=True)
    return Path("waves", f"{name}.fst").resolve()


def run_cocotb(component, test_module: str, work: Path, *, seed: int, sources=(), **env):
    """Run the cocotb tests of `test_module` on the Verilog of a component.

    Parameters
    ----------
    component : Component
    test_module : str
    work : Path
        Empty folder, for logs.
    seed : int
        Of `random` and `cocotb.RANDOM_SEED` in the tests.
    sources : sequence of Path
        Verilog files that the component instances.
    env
        What the tests find in os.environ.
    """
    folder = verilate.build(component, sources=sources, waves=verilate.WAVES_WANTED)
    try:
        verilate.run(
            folder, test_module, work, waves=verilate.WAVES_WANTED, COCOTB_RANDOM_SEED=seed, **env
        )
    finally:
        if verilate.WAVES_WANTED:
            test = os.environ.get("PYTEST_CURRENT_TEST", test_module).split("::")[-1]
            kept = waves_file(f"{test_module}.{test.split(' ')[0]}")
            shutil.move(work / verilate.WAVES, kept)
            print(f"waves: {kept}")


class SideBySide(wiring.Component):
    """Components in one Verilog, so that one build serves all: port `i` of `tiny` is `tiny__i`.

    A stream that is always ready has no ready there: a constant cannot be a port.
    """

    def __init__(self, components: dict[str, wiring.Component]):
        self.components = components
        super().__init__({
            name: Out(
                wiring.Signature({
                    port: _without_constants(member)
                    for port, member in part.signature.members.items()
                })
            )
            for name, part in components.items()
        })

    def elaborate(self, platform):
        m = Module()
        for name, part in self.components.items():
            m.submodules[name] = part
            for port, member in part.signature.members.items():
                outer, inner = getattr(getattr(self, name), port), getattr(part, port)
                # flipped() takes no arrays
                pairs = zip(outer, inner, strict=True) if member.dimensions else [(outer, inner)]
                for one, other in pairs:
                    _join(m, member, one, other)
        return m


def one_of(make: Callable, parameters: dict, name: str) -> SideBySide:
    """The unit that `make` makes of parameters[name], on Verilator beside those of all others.

    Verilator builds slowly, and so once for all tests. Icarus runs all that it has built, slowly.
    """
    alone = verilate.simulator() == "icarus"
    wanted = [name] if alone else parameters
    return SideBySide({key: make(parameters[key]) for key in wanted})


def _without_constants(member: wiring.Member) -> wiring.Member:
    """A member of a signature, but that of a stream that is always ready has no ready."""
    if not member.is_signature:
        return member
    parts = {name: _without_constants(part) for name, part in member.signature.members.items()}
    if getattr(member.signature, "always_ready", False):
        del parts["ready"]
    elif parts == dict(member.signature.members.items()):
        return member
    return Out(wiring.Signature(parts)).array(*member.dimensions)  # the parts are flipped if it is


def _join(m: Module, member: wiring.Member, outer, inner):
    """Make a port of a part one of the whole."""
    if not member.is_signature:
        m.d.comb += outer.eq(inner) if member.flow == Out else inner.eq(outer)
        return
    for path, part, value in inner.signature.flatten(inner):
        if not isinstance(value, Const):
            port = outer
            for name in path:
                port = port[name] if isinstance(name, int) else getattr(port, name)
            m.d.comb += port.eq(value) if part.flow == Out else value.eq(port)


def unbuilt(component: wiring.Component):
    """A component that is asked for its shapes only: Amaranth warns of one that is not built."""
    component._MustUse__silence = True
    return component
