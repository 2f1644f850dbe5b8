"""What nextpnr's report says."""

import re
from itertools import groupby

CELL = re.compile(r"_(TRELLIS_FF|LUT4|PFUMX|L6MUX21|CCU2C|D[IO][AB]?\d*|MULT18X18D)(_.*)?$")
"""What Yosys adds to the name of a signal, for the cell that drives it."""


def fmax_mhz(report: dict) -> float | None:
    """Fmax of the clock that is nearest to its limit; None where there is no clock."""
    clocks = report["fmax"].values()
    slowest = min(clocks, key=lambda clock: clock["achieved"] / clock["constraint"], default=None)
    return slowest and slowest["achieved"]


def placed(report: dict) -> dict[str, list[int]]:
    """Cells of each kind, by nextpnr's names: used and there."""
    counts = report["utilization"]
    return {cell: [count["used"], count["available"]] for cell, count in counts.items()}


def critical_path(report: dict) -> list[dict]:
    """Points of the slowest path from register to register, by the signal that they lead to.

    Of {name, logic_ns, routing_ns}; the cells of one signal are one. Empty where there is none.
    """
    paths = [p["path"] for p in report["critical_paths"] if p["from"] == p["to"]]
    found = []
    for name, cells in groupby(
        paths[0] if paths else [], lambda point: _signal(point["to"]["cell"])
    ):
        cells = list(cells)
        routing = sum(cell["delay"] for cell in cells if cell["type"] == "routing")
        whole = sum(cell["delay"] for cell in cells)
        found.append({"name": name, "logic_ns": whole - routing, "routing_ns": routing})
    return found


def _signal(cell: str) -> str:
    """The signal of ours that a cell drives, below the unit."""
    return CELL.sub("", cell.removeprefix("unit.")).replace("$", "")
