"""What a clock comes to: updates and rays a second, beside those of the board of 2006."""

import json
from pathlib import Path

from sim.errors import InputError

CHARACTER = 80_000
"""Triangles of the character that the board of 2006 was measured with."""

BOARD_2006_MHZ = 66.0
BOARD_2006 = {
    "node_updates_per_second_peak": BOARD_2006_MHZ * 1e6,
    "updates_per_second_80k": 200,
    "rays_per_second": (2e6, 8e6),
}
"""The Virtex-4 board of Woop, Marmitt and Slusallek (2006), at 66 MHz."""


def throughput(mhz: float, update: dict | None, render: dict | None) -> dict[str, float]:
    """Figures a second at a clock, of what `bkd-sim update` and `bkd-sim render` measured.

    A node at most is updated a cycle; a tree has a node less than it has triangles.
    """
    found = {"node_updates_per_second_peak": mhz * 1e6}
    if update:
        triangles = mhz * 1e6 / update["cycles_per_triangle"]
        found["node_updates_per_second"] = triangles * (1 - 1 / update["triangles"])
        found["updates_per_second_80k"] = triangles / CHARACTER
    if render:
        found["rays_per_second"] = mhz * 1e6 / render["cycles_per_ray"]
    return found


def figures_of(file: Path | None, command: str, key: str) -> dict | None:
    """What `bkd-sim COMMAND --json FILE` wrote.

    Raises
    ------
    InputError
        It is not that.
    """
    if not file:
        return None
    try:
        figures = json.loads(file.read_text())
        if figures[key] > 0:
            return figures
    except OSError as error:
        raise InputError(f"{file}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError):
        pass
    raise InputError(f"{file}: has no {key}; make it with bkd-sim {command} SCENE --json {file}")
