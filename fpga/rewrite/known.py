"""Parts of signals that have names of their own, and results that are constant."""

import re
from copy import copy

from fpga.rewrite.expression import Expression
from fpga.rewrite.sites import Site
from fpga.rewrite.syntax import Module, spaced


def put_known(module: Module, sites: list[Site]):
    """Put names of parts of signals, and values of constants, for what they stand for."""
    aliases, constants = _aliases(module, sites), _constants(sites)
    for site in sites:
        site.expression = _aliased(site, aliases, constants)


def _aliases(module: Module, sites: list[Site]) -> dict[str, str]:
    """Names of parts of signals, by their text, and constants by the names of such signals."""
    found: dict[str, str] = {}
    for site in sites:
        if site.always and site.target and site.width == site.expression.width:
            if not site.target.startswith("\\$") and "[" in site.expression.text:
                found.setdefault(site.expression.text, site.target)
    return {text: name for text, name in found.items() if not module.signals[name].direction}


def _constants(sites: list[Site]) -> dict[str, str]:
    """Values of intermediate results that are constant."""
    return {
        site.target: site.expression.text
        for site in sites
        if site.always
        and site.target.startswith("\\$")
        and re.fullmatch(r"\d+'h[0-9a-f]+", site.expression.text)
    }


def _part(found: Expression, constants: dict[str, str]) -> str | None:
    """The value of a constant or of a part of one, if an atom is that."""
    match = re.fullmatch(r"(\\\$\S+) (?:\[(\d+)(?::(\d+))?\])?", found.text)
    if not match or match[1] not in constants:
        return None
    low = int(match[3] or match[2] or 0)
    value = int(constants[match[1]].split("h")[1], 16) >> low & (1 << found.width) - 1
    return f"{found.width}'h{value:0{-(-found.width // 4)}x}"


def _aliased(site: Site, aliases: dict[str, str], constants: dict[str, str]) -> Expression:
    """The expression of a site, with the parts of signals by their names."""

    def exchange(found: Expression) -> Expression:
        result = copy(found)
        result.operands = [exchange(x) for x in found.operands]
        if value := _part(found, constants):
            result.name, result.text = "", value
        name = aliases.get(found.text)
        if name and name != site.target:
            result.name, result.text = name, spaced(name)
        return result

    return exchange(site.expression)
