"""Modules that are alike, once; and names of modules that say what they are."""

import re
from collections import Counter

from fpga.rewrite.plain import Names
from fpga.rewrite.syntax import CONNECTION, TOKEN, Assign, Block, Module, identifiers, spaced


def share(modules: list[Module], top: str, kinds: dict[str, str]) -> list[Module]:
    """The modules that differ in more than names, below the top; parents first.

    Parameters
    ----------
    modules : list of Module
    top : str
        Its name stays.
    kinds : dict of str
        What each module is, by its path in the design.
    """
    by_name = {module.name: module for module in modules}
    chosen: dict[str, tuple[Module, dict[str, str]]] = {}  # and its port for each port
    known: dict[str, tuple[Module, list[str]]] = {}
    order: list[Module] = []

    def visit(module: Module):
        for item in module.items:
            if (match := module.instance(item)) and match[1].strip() not in chosen:
                visit(by_name[match[1].strip()])
        _connect(module, chosen)
        text, numbered = _canonical(module)
        first, names = known.setdefault(text, (module, numbered))
        chosen[module.name] = first, dict(zip(numbered, names, strict=True))
        if first is module:
            order.append(module)

    visit(by_name[top])
    new = _names(order, top, kinds)
    for module in order:
        for item in module.items:
            if match := module.instance(item):
                assert isinstance(item, Block)
                item.lines[0] = f"  {new[match[1].strip()]} {match[2].strip()} ("
    for module in order:
        module.name = new[module.name]
    return order[::-1]


def _connect(module: Module, chosen: dict[str, tuple[Module, dict[str, str]]]):
    """Instances of what a module was found to be like, with its ports in their order."""
    for item in module.items:
        if not (match := module.instance(item)):
            continue
        assert isinstance(item, Block)
        other, ports = chosen[match[1].strip()]
        found = {}
        for line in item.lines[1:]:
            if connection := CONNECTION.match(line):
                found[ports[connection[1].strip()]] = connection[2].strip()
        lines = [f"    .{port}({found[port]})" for port in other.ports if port in found]
        # The name of a module is an escaped one by now.
        item.lines = [f"  {spaced(other.name)} {match[2]} (", *_commas(lines), "  );"]


def _commas(lines: list[str]) -> list[str]:
    return [f"{line}," for line in lines[:-1]] + lines[-1:]


def _canonical(module: Module) -> tuple[str, list[str]]:
    """Text of a module with numbers for names, and the names in the order of their numbers."""
    numbers: dict[str, int] = {}
    parts = []
    for item in module.items:
        lines = [f"{item.left} = {item.right}"] if isinstance(item, Assign) else item.lines
        keep = set()
        if match := module.instance(item):
            keep = {match[1].strip(), match[2].strip()}
            keep |= {c[1].strip() for line in lines if (c := CONNECTION.match(line))}
            # The names of instances are not part of what a module does.
            parts.append(match[1].strip())
            lines = lines[1:]
        for line in lines:
            port = CONNECTION.match(line)
            head, rest = (f".{port[1]}", port[2]) if port else ("", line)
            parts.append(head + TOKEN.sub(lambda m: _number(m[0], numbers), rest))
    for port in sorted(set(module.ports) - set(numbers), key=module.ports.index):
        numbers[port] = len(numbers)
    for name in sorted(set(module.signals) - set(numbers)):
        numbers[name] = len(numbers)
    for name in numbers:
        signal = module.signals[name]
        parts.append(f"{signal.direction} {signal.kind} {signal.bits} {signal.rest}")
    return "\n".join(parts), list(numbers)


def _number(token: str, numbers: dict[str, int]) -> str:
    name = token.strip()
    if name not in identifiers(token):
        return token
    return f"@{numbers.setdefault(name, len(numbers))}"


def _names(modules: list[Module], top: str, kinds: dict[str, str]) -> dict[str, str]:
    """A new name for each module: its kind, and the instance where there are several of a kind."""
    names = Names([top])
    new = {top: top}
    rest = [module.name for module in modules if module.name != top]
    paths = {name: re.sub(r"\$\d+(?=\.|$)", "", name.lstrip("\\")) for name in rest}
    count = Counter(kinds[path] for path in paths.values())
    for name, path in paths.items():
        (above, instance), kind = path.rsplit(".", 1), kinds[path]
        parts = [kind]
        if count[kind] > 1:
            parts = [kinds.get(above, ""), kind] if instance == kind else [kind, instance]
        new[name] = names.new("_".join([top, *filter(None, parts)]))
    return new
