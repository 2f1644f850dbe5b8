"""Policies of updates on one scene: their cells, and what comes of them in words and tables."""

from collections.abc import Mapping, Sequence

from hdl.fp.format import F24
from sim.scene.scene import Scene
from sim.study.policies.policy import POLICIES
from sim.study.precision.tables import percent

FRAMES = 8
"""Frames of a study, at most: the first ones of the scene."""
WIDTH, HEIGHT = 160, 120
UPDATES = ("policy", "update", "rays", "both", "of every", "lost", "differ")
COLUMNS = (
    "scene",
    "policy",
    "refused",
    "update_cycles",
    "render_cycles",
    "cycles",
    "lost",
    "false",
    "changed",
    "different_share",
    "mismatches",
)
"""Of the table of all policies."""


def update_cells(spec: str, scene: Scene) -> list[dict]:
    """A cell of sim.study.policies.measure a policy; none for a scene that does not move."""
    frames = list(range(min(scene.frames, FRAMES)))
    first = scene.pose(0)
    if all((scene.pose(frame) == first).all() for frame in frames):
        return []
    same = {
        "scene": spec,
        "format": str(F24),
        "frames": frames,
        "width": WIDTH,
        "height": HEIGHT,
    }
    return [{**same, "policy": policy} for policy in POLICIES]


def update_rows(
    names: Mapping[str, str], cells: Sequence[dict], results: Sequence[dict]
) -> list[dict]:
    """COLUMNS and frames of each policy, of which a refused one has the first few only."""
    return [
        {
            "scene": names[cell["scene"]],
            "policy": cell["policy"],
            "frames": cell["frames"],
            **result,
        }
        for cell, result in zip(cells, results, strict=True)
    ]


def updates_conclusion(rows: Sequence[dict]) -> str:
    """The cheapest policy that loses nothing, held against the first one, and what loses hits."""
    first = rows[0]
    safe = [row for row in rows if not row["lost"]]
    best = min(safe or rows, key=lambda row: row["cycles"])
    if best is first:
        words = f"no other policy that loses no hit takes fewer cycles than {first['policy']}"
    else:
        words = (
            f"{best['policy']} takes {best['cycles'] / first['cycles']:.3f} times the cycles of "
            f"{first['policy']}, update and rays together, and loses {best['lost']:,} hits"
        )
    lossy = [f"{row['policy']} ({row['lost']:,})" for row in rows if row["lost"]]
    share = first["update_cycles"] / first["cycles"]
    lost = f" Hits are lost by {', '.join(lossy)}." if lossy else ""
    return (
        f"{first['scene']}, {len(first['frames'])} frames at {F24}: {words}; the update is "
        f"{percent(share)} of {first['policy']}.{lost}"
    )


def updates_table(rows: Sequence[dict]) -> list[list[str]]:
    """Cells under UPDATES; cycles in millions."""
    return [
        [
            row["policy"],
            *(f"{row[name] / 1e6:.3f}" for name in ("update_cycles", "render_cycles", "cycles")),
            f"{row['cycles'] / rows[0]['cycles']:.3f}",
            f"{row['lost']:,}",
            percent(row["different_share"]),
        ]
        for row in rows
    ]
