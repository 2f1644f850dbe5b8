"""The Verilog that Yosys writes, as declarations and statements."""

import re
from dataclasses import dataclass, field

IDENTIFIER = r"(?:\\\S+(?: |$)|(?<![\w'$\\])[A-Za-z_]\w*)"
"""An identifier; an escaped one with the blank that ends it."""

TOKEN = re.compile(rf"\d*'s?[bdho][0-9a-fA-FxXzZ_?]+|\$[a-z]+|{IDENTIFIER}")
DECLARATION = re.compile(
    rf"  (input|output|wire|reg)( signed)?( \[[^]]*\])? ({IDENTIFIER}) ?(.*);$"
)
ASSIGN = re.compile(r"  assign (.+?) = (.+);$")
INSTANCE = re.compile(rf"  ({IDENTIFIER}) ?({IDENTIFIER}) ?\($")
CONNECTION = re.compile(rf"    \.({IDENTIFIER}) ?\((.*)\),?$")
KEYWORDS = set(
    "module endmodule input output wire reg signed assign always initial begin end if else case "
    "casez endcase default for posedge negedge or".split()
)


@dataclass
class Declaration:
    """A signal: `direction` is empty where it is no port, `rest` an initial value or a depth."""

    kind: str
    bits: str
    rest: str
    direction: str = ""

    @property
    def width(self) -> int:
        """Of a word of it."""
        return 1 + int(self.bits[1:].split(":")[0]) if self.bits else 1


@dataclass
class Block:
    """Lines that belong together: a process, an initial block, an instance."""

    lines: list[str]


@dataclass
class Assign:
    """A continuous assignment."""

    left: str
    right: str


@dataclass
class Module:
    """A module. Names are as in the text, without the blank after an escaped one."""

    name: str
    ports: list[str]
    signals: dict[str, Declaration] = field(default_factory=dict)
    items: list[Block | Assign] = field(default_factory=list)

    def instance(self, item: Block | Assign) -> re.Match | None:
        """Match of module and name, if an item is an instance."""
        if isinstance(item, Assign) or item.lines[0].startswith(("  always", "  initial")):
            return None
        return INSTANCE.match(item.lines[0])


def parse(text: str) -> list[Module]:
    """The modules of a file.

    Raises
    ------
    ValueError
        A line is not as Yosys writes it.
    """
    modules = []
    text = re.sub(r"^ *\(\* .* \*\)\n", "", text, flags=re.MULTILINE)  # attributes
    text = text.replace("/* empty */;", ";")
    for part in re.findall(r"^module .*?^endmodule", text, re.MULTILINE | re.DOTALL):
        head, body = part.split(");\n", 1)
        name, ports = head.removeprefix("module ").split("(", 1)
        module = Module(name.strip(), [port.strip() for port in ports.split(",") if port.strip()])
        for lines in _groups(body.split("\n")[:-1]):
            _add(module, lines)
        modules.append(module)
    return modules


def _groups(lines: list[str]) -> list[list[str]]:
    groups: list[list[str]] = []
    for line in lines:
        if re.match(r"  \S", line) and line not in ("  end", "  );"):
            groups.append([])
        groups[-1].append(line)
    return groups


def _add(module: Module, lines: list[str]):
    first = lines[0]
    if len(lines) == 1 and (match := DECLARATION.match(first)):
        kind, signed, bits, name, rest = match.groups()
        if signed:
            raise ValueError(f"{module.name}: {first}")
        bits, name = (bits or "").strip(), name.strip()
        known = module.signals.setdefault(name, Declaration(kind, bits, rest))
        if kind in ("input", "output"):
            known.direction = kind
            known.kind = "wire"
        else:
            known.kind, known.rest = kind, rest
    elif len(lines) == 1 and (match := ASSIGN.match(first)):
        module.items.append(Assign(match[1].strip(), match[2].strip()))
    elif first.startswith(("  always", "  initial")) or INSTANCE.match(first):
        module.items.append(Block(lines))
    else:
        raise ValueError(f"{module.name}: {first}")


def render(module: Module) -> str:
    """The text of a module: ports in its head, signals, instances, assignments, processes."""
    ports = ",\n".join(f"  {_declare(port, module.signals[port])}" for port in module.ports)
    inner = [
        f"  {_declare(name, signal)};"
        for name, signal in module.signals.items()
        if not signal.direction
    ]
    parts = [inner, [], [], []]
    for item in module.items:
        if isinstance(item, Assign):
            parts[2].append(f"  assign {item.left} = {item.right};")
        elif module.instance(item):
            parts[1] += item.lines
        else:
            parts[3] += ["", *item.lines] if parts[3] else item.lines
    body = "\n\n".join("\n".join(lines) for lines in parts if lines)
    text = f"module {module.name} (\n{ports}\n);\n{body}\nendmodule\n"
    return "\n".join(line.rstrip() for line in text.split("\n"))


def _declare(name: str, signal: Declaration) -> str:
    words = [signal.direction, signal.kind, signal.bits, name, signal.rest]
    return " ".join(word for word in words if word)


def identifiers(text: str) -> list[str]:
    """Identifiers in a text, in their order, without the blank after an escaped one."""
    found = (token.strip() for token in TOKEN.findall(text))
    return [t for t in found if (t[0] in "\\_" or t[0].isalpha()) and t not in KEYWORDS]


def names_in(item: Block | Assign) -> list[str]:
    """Identifiers in an item, in their order."""
    lines = [item.left, item.right] if isinstance(item, Assign) else item.lines
    return [name for line in lines for name in identifiers(line)]


def spaced(name: str) -> str:
    """A name as it stands in a text: an escaped one with the blank that ends it."""
    return f"{name} " if name[0] == "\\" else name


def rename(text: str, names: dict[str, str]) -> str:
    """A text with some identifiers exchanged."""

    def exchange(match: re.Match) -> str:
        token = match[0].strip()
        # The blank that ended an escaped name goes, unless it sets off what follows.
        blank = " " if match[0] != token and re.match(r"[<=+]", match.string[match.end() :]) else ""
        return names[token] + blank if token in names else match[0]

    return re.sub(r"(?<=\S)  +", " ", TOKEN.sub(exchange, text))
