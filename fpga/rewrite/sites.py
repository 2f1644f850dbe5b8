"""Where expressions stand in a module, and which names they read."""

import re
from collections.abc import Callable
from dataclasses import dataclass

from fpga.rewrite.expression import Expression, Parser
from fpga.rewrite.syntax import CONNECTION, Assign, Module, identifiers

LINE = re.compile(
    r"(?P<assign>\s+(?P<left>[^=(]+?) <?= )(?P<value>.+);$"
    r"|(?P<branch>.*\b(?:if|casez?) \()(?P<condition>.+)(?P<end>\)(?: begin)?)$"
)


@dataclass
class Site:
    """A place of an expression.

    Attributes
    ----------
    width : int
        Of what it is assigned to; 0 elsewhere.
    target : str
        The signal that it is assigned to, if that is a whole one.
    always : bool
        It is so at any time: no process.
    """

    expression: Expression
    width: int
    write: Callable[[str], None]
    target: str
    always: bool


def sites_of(module: Module) -> list[Site]:
    """All expressions of a module that are understood."""
    parser = Parser(module.signals)
    sites = []

    def add(text: str, left: str, write: Callable[[str], None], always: bool = False):
        target = parser.parse(left) if left else None
        width = target.width if target else 0
        if (found := parser.parse(text)) and (target or not left):
            sites.append(Site(found, width, write, target.name if target else "", always))

    for item in module.items:
        if isinstance(item, Assign):
            add(item.right, item.left, lambda text, item=item: setattr(item, "right", text), True)
            continue
        for k, line in enumerate(item.lines):
            if match := CONNECTION.match(line):
                before, after = line[: match.start(2)], line[match.end(2) :]
                left, text = "", match[2]
            elif (match := LINE.match(line)) and match["assign"]:
                before, after = match["assign"], ";"
                left, text = match["left"], match["value"]
            elif match:
                before, after = match["branch"], match["end"]
                left, text = "", match["condition"]
            else:
                continue

            def write(text, lines=item.lines, k=k, before=before, after=after):
                lines[k] = f"{before}{text}{after}"

            add(text, left, write)
    return sites


def names_read(module: Module) -> list[str]:
    """Every identifier in the items of a module but for what is assigned to."""
    found = []
    for item in module.items:
        if isinstance(item, Assign):
            # Names in the brackets at the left are read too; Yosys has only numbers there.
            found += identifiers(item.right)
            continue
        for line in item.lines:
            match = LINE.match(line)
            found += identifiers(line[match.end("assign") :] if match and match["assign"] else line)
            if match and match["assign"] and (index := re.search(r"\[(.*)\]", match["left"])):
                found += identifiers(index[1])
    return found
