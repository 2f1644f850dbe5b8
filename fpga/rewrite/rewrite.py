"""All rewriting steps, one after the other."""

from collections.abc import Sequence

from fpga.rewrite.adopt import adopt
from fpga.rewrite.inline import inline
from fpga.rewrite.memories import loop_initial
from fpga.rewrite.names import name_signals, rename_connections
from fpga.rewrite.processes import merge_registers, settle_triggers
from fpga.rewrite.share import share
from fpga.rewrite.syntax import parse, render
from fpga.rewrite.unread import drop_unread


def rewrite(text: str, top: str, kinds: dict[str, str], ports: Sequence[str] = ()) -> str:
    """Verilog for people of the Verilog that Yosys writes.

    Parameters
    ----------
    text : str
    top : str
        The module that stays as it is called.
    kinds : dict of str
        What each of the others is, by its path in the design.
    ports : sequence of str
        Of the top, in the order that they get.
    """
    modules = parse(text)
    for module in modules:
        adopt(module)
        inline(module)
        merge_registers(module)
        settle_triggers(module)
        loop_initial(module)
        drop_unread(module)
    outputs = {
        module.name: {p for p in module.ports if module.signals[p].direction == "output"}
        for module in modules
    }
    renamed = {}
    for module in modules:
        before = list(module.ports)
        name_signals(module, outputs)
        renamed[module.name] = dict(zip(before, module.ports, strict=True))
    for module in modules:
        rename_connections(module, renamed)
        first = ["clk", "rst", *(ports if module.name == top else ())]
        order = {port: k for k, port in enumerate(first)}
        module.ports.sort(key=lambda port: order.get(port, len(order)))
    return "\n".join(map(render, share(modules, top, kinds)))
