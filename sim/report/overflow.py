"""Numbers that became infinite, for tables."""


def overflow_text(overflows: dict[str, int]) -> str:
    """Where they did, of the places of hdl.core.counters, by the runs in which they did."""
    return ", ".join(name for name, runs in overflows.items() if runs) or "none"
