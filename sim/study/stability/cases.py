"""The study as cells of sim.study.sweep, and back."""

import importlib.metadata
from collections.abc import Sequence

import numpy as np

from hdl.fp.format import FloatFormat
from sim.command import format_of
from sim.study.stability.closed import closed, moved, scaled
from sim.study.stability.degenerate import degenerate
from sim.study.stability.ends import ends
from sim.study.stability.room import room
from sim.study.stability.slivers import slivers
from sim.study.stability.tracers import systems

CASES = {
    "closed": lambda makers, fmt, rng: closed(makers, rng),
    "moved": lambda makers, fmt, rng: moved(makers, rng),
    "scaled": lambda makers, fmt, rng: scaled(makers, rng),
    "slivers": slivers,
    "degenerate": degenerate,
    "room": room,
    "ends": ends,
}
"""Rows by name of a case: of makers, the format and a random generator."""

PEERS = ("embreex", "warp-lang")
"""Distributions that the peers come from."""


def cells(names: Sequence[str], fmt: FloatFormat, seed: int, peers: bool) -> list[dict]:
    """One cell for each of CASES that is named: {"case", "format", "seed", "peers"}.

    `peers` lists those that are wanted, with their versions.

    Raises
    ------
    InputError
        The peers are wanted and not installed.
    """
    systems(fmt, peers)
    versions = [f"{of} {importlib.metadata.version(of)}" for of in PEERS if peers]
    same = {"format": str(fmt), "seed": seed, "peers": versions}
    return [{"case": name, **same} for name in names]


def measure(cell: dict) -> dict:
    """{"case", "rows"}: rows as sim.study.stability.rows.row says."""
    fmt = format_of(cell["format"])
    makers = systems(fmt, bool(cell["peers"]))
    rows = CASES[cell["case"]](makers, fmt, np.random.default_rng(cell["seed"]))
    return {"case": cell["case"], "rows": rows}


def wrong(results: Sequence[dict]) -> list[str]:
    """A line for each row that is not as it must be."""
    return [
        f"{of['case']}, {row['name']}: {row['verdict']}"
        for of in results
        for row in of["rows"]
        if not row["ok"]
    ]
