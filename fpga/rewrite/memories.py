"""Initial values of memories in a line."""

import re

from fpga.rewrite.syntax import Block, Declaration, Module

WORD = re.compile(r"    (\S+ ?)\[(\d+)\] = (\S+);$")
ROW = "\\$row"


def loop_initial(module: Module):
    """Fill a memory in a loop, where all of its words begin alike."""
    for item in module.items:
        if not isinstance(item, Block) or item.lines[0] != "  initial begin":
            continue
        words = [WORD.match(line) for line in item.lines[1:-1]]
        found = {(word[1], word[3]) for word in words if word}
        if len(found) == 1 and all(words) and len(words) > 1:
            memory, value = found.pop()
            module.signals.setdefault(ROW, Declaration("integer", "", ""))
            row = f"{ROW} "
            rows = f"{row}= 0; {row}< {len(words)}; {row}= {row}+ 1"
            item.lines[1:-1] = [f"    for ({rows}) {memory}[{row}] = {value};"]
