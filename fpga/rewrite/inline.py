"""Intermediate results without a name of their own, put where they are used.

Yosys gives each operator a wire. Here those that are used once become parts of expressions, where
Verilog's rules of width and sign let them mean the same.
"""

import re
from collections import Counter
from copy import copy

from fpga.rewrite.expression import COMPARES, MODULAR, Expression
from fpga.rewrite.known import put_known
from fpga.rewrite.sites import Site, names_read, sites_of
from fpga.rewrite.syntax import Assign, Module
from fpga.rewrite.unread import drop_unread

LONGEST = 80
"""Characters of an expression that is put into another."""

SHORT, FEW = 60, 4
"""Characters of an expression that is put into so many others; longer ones into one only."""


def inline(module: Module):
    """Put intermediate results where they are used; drop signals that nobody reads."""
    sites = sites_of(module)
    put_known(module, sites)
    _Inliner(module, sites).run()
    for site in sites:
        site.write(str(site.expression))
    drop_unread(module)


class _Inliner:
    def __init__(self, module: Module, sites: list[Site]):
        self.module = module
        self.sites = sites
        self.uses = Counter(names_read(module))
        self.sources = {
            site.target: site
            for site in sites
            if site.always
            and site.target.startswith("\\$")
            and site.width == module.signals[site.target].width
        }
        self.taken: Counter[str] = Counter()
        self.expanded: set[int] = set()

    def run(self):
        for site in self.sites:
            self._expand_site(site)
        gone = {name for name in self.sources if self.taken[name] == self.uses[name]}
        self.module.items = [
            item
            for item in self.module.items
            if not (isinstance(item, Assign) and item.left in gone)
        ]
        for name in gone:
            del self.module.signals[name]

    def _expand_site(self, site: Site):
        if id(site) in self.expanded:
            return
        self.expanded.add(id(site))
        found = site.expression
        source = self._source(found)
        if source and not site.width:
            if found.name and self._may(source, found.width, 0, False):
                site.expression = self._take(found)
        elif source:
            # The whole of what is assigned: its context stays as it was.
            low = re.match(r".* \[(\d+):0\]$|.* \[(0)\]$", found.text)
            if found.name:
                if found.width == site.width:
                    site.expression = self._take(found)
            elif low and int(low[1] or 0) + 1 == site.width and _fits(source, site.width):
                site.expression = _trimmed(self._take(found), site.width)
        else:
            site.expression = self._expand(found, site.width, site.width > 0)

    def _source(self, atom: Expression) -> Expression | None:
        """What an intermediate result is, with its own intermediate results put in."""
        name = atom.name or (atom.text.split(" ")[0] if "[" in atom.text else "")
        site = self.sources.get(name)
        if atom.operator or not site:
            return None
        self._expand_site(site)
        uses, length = self.uses[name], len(str(site.expression))
        return site.expression if uses == 1 or (uses <= FEW and length <= SHORT) else None

    def _take(self, atom: Expression) -> Expression:
        name = atom.name or atom.text.split(" ")[0]
        self.taken[name] += 1
        return self.sources[name].expression

    def _expand(self, found: Expression, around: int, held: bool) -> Expression:
        """`held`: the width around is that of an assignment, whatever the operands are."""
        if not found.operator:
            return found
        result = copy(found)
        result.operands = []
        held = held and around >= found.width and found.operator not in COMPARES
        for operand, context in zip(found.operands, found.contexts(around), strict=True):
            source = self._source(operand) if operand.name else None
            if source and self._may(source, operand.width, context, held):
                result.operands.append(self._take(operand))
            else:
                result.operands.append(self._expand(operand, context, held and context > 0))
        return result

    @staticmethod
    def _may(source: Expression, width: int, context: int, held: bool) -> bool:
        if len(str(source)) > LONGEST:
            return False
        if context == 0:  # by itself here as there, if it is as wide
            return source.width == width
        if source.signed or context != width:
            return False
        return source.width == width or (source.width < width and held)


def _fits(found: Expression, width: int) -> bool:
    """Whether the lowest bits of an expression are those of one of narrow operands."""
    if not found.operator:
        return found.width <= width or _constant(found, width) is not None
    if found.operator == "?":
        return all(_fits(x, width) for x in found.operands[1:])
    return found.operator in MODULAR and all(_fits(x, width) for x in found.operands)


def _constant(found: Expression, width: int) -> str | None:
    match = re.fullmatch(r"\d+'h([0-9a-f]+)", found.text)
    if match and int(match[1], 16) < 1 << width:
        return f"{width}'h{int(match[1], 16):0{-(-width // 4)}x}"
    return None


def _trimmed(found: Expression, width: int) -> Expression:
    """An expression that `_fits`, with its constants as narrow as that."""
    result = copy(found)
    if not found.operator and found.width > width:
        result.text, result.width = str(_constant(found, width)), width
    start = 1 if found.operator == "?" else 0
    result.operands = found.operands[:start] + [_trimmed(x, width) for x in found.operands[start:]]
    return result.measured()
