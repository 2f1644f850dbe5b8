"""Names for results that are only passed on: those of what they are passed to."""

import re
from collections import Counter

from fpga.rewrite.syntax import Assign, Module, identifiers, rename, spaced

NAMELESS = re.compile(r"\\\$.*|_\d+_")


def adopt(module: Module):
    """Where all that is done with a nameless signal is to assign it to another, it is the other."""
    drivers = Counter(
        name for item in module.items if isinstance(item, Assign) for name in identifiers(item.left)
    )
    names = {}
    for item in module.items:
        if not isinstance(item, Assign) or item.left not in module.signals:
            continue
        if NAMELESS.fullmatch(item.left):
            continue
        source = item.right.strip()
        target, passed = module.signals[item.left], module.signals.get(source)
        if passed and NAMELESS.fullmatch(source) and source not in names and not passed.direction:
            whole = target.bits == passed.bits and drivers[item.left] == 1
            if whole and target.direction != "input" and not target.rest:
                names[source] = item.left
    for source, target in names.items():
        passed = module.signals.pop(source)
        module.signals[target].kind, module.signals[target].rest = passed.kind, passed.rest
    texts = {source: spaced(target) for source, target in names.items()}
    kept = []
    for item in module.items:
        if isinstance(item, Assign):
            if names.get(item.right.strip()) == item.left:
                continue
            item.left = rename(item.left, texts).strip()
            item.right = rename(item.right, texts)
        else:
            item.lines = [rename(line, texts) for line in item.lines]
        kept.append(item)
    module.items = kept
