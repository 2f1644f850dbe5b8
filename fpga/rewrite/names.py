"""Names that plain Verilog has, for signals that have others or none."""

import re

from fpga.rewrite.expression import Expression, Parser
from fpga.rewrite.plain import RESERVED, Names
from fpga.rewrite.syntax import CONNECTION, Assign, Block, Module, identifiers, rename

WORDS = {
    **{"+": "plus", "-": "minus", "*": "times", "/": "over", "%": "modulo"},
    **{"&": "and", "|": "or", "^": "differs", "~": "not", "!": "none", "?": "chosen"},
    **{"==": "equals", "!=": "differs", "<": "below", "<=": "up_to", ">": "above", ">=": "from"},
    **{"<<": "shifted", ">>": "shifted", ">>>": "shifted", "{": "joined", "$": "signed"},
    **{"r|": "any", "r&": "all", "r^": "parity"},
}
LONGEST = 40


def name_signals(module: Module, outputs: dict[str, set[str]]):
    """Give plain names to signals and instances; `outputs` are the output ports of each module."""
    plain = [
        name
        for name in module.signals
        if name[0] != "\\" and name not in RESERVED and not re.fullmatch(r"_\d+_", name)
    ]
    names = Names(plain)
    from_instances = _connected(module, outputs)
    sources = _sources(module)
    found = {}
    odd = [name for name in module.signals if name not in names.taken or name in RESERVED]
    # Those that others take their names from go first.
    for name in sorted(odd, key=lambda name: (name in sources, name.startswith("\\$"))):
        bare = name.lstrip("\\")
        base = re.sub(r"(\$\d+)+$", "", bare)
        if name in from_instances:
            found[name] = names.new(from_instances[name])
        elif name in sources:
            found[name] = names.new(_of_result(sources[name], found))
        elif re.fullmatch(r"_\d+_", name):
            found[name] = names.new("word")
        elif base.startswith("$auto$"):
            found[name] = names.new("time_zero")
        else:
            found[name] = names.new(base.strip("$") or "value")
    for item in module.items:
        if match := module.instance(item):
            instance = match[2].strip()
            if instance in names.taken or instance[0] == "\\":
                bare = re.sub(r"(\$\d+)+$", "", instance.lstrip("\\"))
                new = names.new(bare)
                assert isinstance(item, Block)
                item.lines[0] = f"  {match[1]} {new} ("
    _apply(module, found)


def _connected(module: Module, outputs: dict[str, set[str]]) -> dict[str, str]:
    """Names for signals that have a number in theirs, after the instance that drives them."""
    found = {}
    for item in module.items:
        if not (match := module.instance(item)):
            continue
        assert isinstance(item, Block)
        instance = re.sub(r"(\$\d+)+$", "", match[2].strip().lstrip("\\"))
        for line in item.lines[1:]:
            if connection := CONNECTION.match(line):
                port, signal = connection[1].strip(), connection[2].strip()
                if re.fullmatch(r"\\\S*\$\d+", signal) and port in outputs[match[1].strip()]:
                    found[signal] = f"{instance}__{port}"
    return found


def _sources(module: Module) -> dict[str, Expression]:
    """Expressions of intermediate results."""
    parser = Parser(module.signals)
    found = {}
    for item in module.items:
        if isinstance(item, Assign) and re.fullmatch(r"\\\$\d+", item.left):
            if expression := parser.parse(item.right.replace("(", " ").replace(")", " ")):
                found[item.left] = expression
            else:
                found[item.left] = Expression("", text=item.right)
    return found


def _of_result(expression: Expression, names: dict[str, str]) -> str:
    """A name that says what is computed of what."""
    inside = identifiers(str(expression))
    first = next((x for x in inside if not re.match(r"\\\$\d", x)), "")
    first = names.get(first, first.lstrip("\\").split("$")[0])
    word = WORDS.get(expression.operator, "")
    if not expression.operator:
        operator = re.search(r"(?<=\W)(==|!=|<=|>=|<<|>>|[-+*&|^~!?<>{])", f" {expression.text}")
        word = WORDS.get(operator[1], "") if operator else "part"
    return f"{first[:LONGEST] or 'value'}_{word}"


def _apply(module: Module, names: dict[str, str]):
    module.ports = [names.get(port, port) for port in module.ports]
    module.signals = {names.get(k, k): signal for k, signal in module.signals.items()}
    for item in module.items:
        if isinstance(item, Assign):
            item.left = rename(item.left, names).strip()
            item.right = rename(item.right, names)
        elif module.instance(item):
            for k, line in enumerate(item.lines[1:], 1):
                if match := CONNECTION.match(line):
                    signal = rename(match[2], names).strip()
                    item.lines[k] = f"    .{match[1]}({signal}){line[match.end(2) + 1 :]}"
        else:
            item.lines = [rename(line, names) for line in item.lines]


def rename_connections(module: Module, ports: dict[str, dict[str, str]]):
    """Give the ports of instances the names that they have now, `ports` of each module."""
    for item in module.items:
        if match := module.instance(item):
            assert isinstance(item, Block)
            new = ports[match[1].strip()]
            for k, line in enumerate(item.lines):
                if connection := CONNECTION.match(line):
                    rest = line[connection.start(2) - 1 :]
                    item.lines[k] = f"    .{new[connection[1].strip()]}{rest}"
