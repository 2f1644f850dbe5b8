"""Processes as people write them: a register and its next value in one."""

import re
from collections import Counter

from fpga.rewrite.syntax import Block, Module, names_in, spaced

CLOCKED = re.compile(r"  always @\(posedge (\w+)\)$")
SAVE = re.compile(r"    (.+?) ?<= (\\\$\d+) ?;$")
TRIGGER = re.compile(r"    if \((\\\$auto\$\S+?) ?\) begin end$")


def merge_registers(module: Module):
    """Compute the next value of a register where it is kept, if nobody else wants it."""
    uses = Counter(name for item in module.items for name in names_in(item))
    nexts = {}
    for item in module.items:
        if isinstance(item, Block) and item.lines[0] == "  always @* begin":
            targets = {_target(line) for line in item.lines if _target(line)}
            if len(targets) == 1 and (name := targets.pop()).startswith("\\$"):
                if uses[name] == 1 + sum(_target(line) == name for line in item.lines):
                    nexts[name] = item
    gone = []
    for item in module.items:
        if not isinstance(item, Block) or len(item.lines) != 2:
            continue
        clock, save = CLOCKED.match(item.lines[0]), SAVE.match(item.lines[1])
        if clock and save and save[2] in nexts and re.fullmatch(r"[\w\\$.]+ ?", save[1]):
            source = nexts[save[2]]
            item.lines = [f"  always @(posedge {clock[1]}) begin", *_body(source, *save.groups())]
            gone.append(source)
            del module.signals[save[2]]
    module.items = [item for item in module.items if all(item is not other for other in gone)]


def _body(source: Block, register: str, name: str) -> list[str]:
    """Lines of a process that compute a next value, as ones that keep it."""
    register = register.strip()
    lines = []
    for line in source.lines[1:]:
        if TRIGGER.match(line):
            continue
        if _target(line) == name:
            head, value = line.split(" = ", 1)
            head = f"{head} ".replace(f"{name} ", spaced(register), 1).rstrip()
            line = f"{head} <= {value}"
            if value.strip(" ;") == register and line.strip().startswith(f"{register} <="):
                continue  # it stays as it is
        lines.append(line)
    return lines


def _target(line: str) -> str:
    """The signal that a line of a process assigns to."""
    match = re.match(r"\s+(\\\S+ |[A-Za-z_]\w*)(?:\[[^]]*\])? ?(=|<=) ", line)
    return match[1].strip() if match else ""


def settle_triggers(module: Module):
    """Start each process that waits for changes at time 0, when what it reads may never change.

    Yosys sets a register of its own then. In some simulators that comes before processes wait;
    assigned without blocking, it comes after.
    """
    for name in [name for name in module.signals if name.startswith("\\$auto$")]:
        if any(isinstance(item, Block) and name in names_in(item) for item in module.items):
            module.signals[name].rest = ""
            module.items.append(Block([f"  initial {name}  <= 1'b0;"]))
        else:
            del module.signals[name]
