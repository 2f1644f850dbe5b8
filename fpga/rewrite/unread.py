"""What nobody reads."""

from fpga.rewrite.sites import names_read
from fpga.rewrite.syntax import Assign, Module, identifiers, names_in


def drop_unread(module: Module):
    """Drop signals that are assigned and never read, and what is read for them only."""
    while True:
        read = {*names_read(module), *module.ports}
        kept = []
        for item in module.items:
            targets = identifiers(item.left) if isinstance(item, Assign) else []
            if not targets or any(name in read for name in targets):
                kept.append(item)
        if len(kept) == len(module.items):
            break
        module.items = kept
    text = {name for item in module.items for name in names_in(item)} | set(module.ports)
    module.signals = {name: signal for name, signal in module.signals.items() if name in text}
