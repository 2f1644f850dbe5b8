"""Results as tables: a row each, ours beside the peers, the verdict last."""

from collections.abc import Sequence

from sim.study.section import Grid
from sim.study.stability.tracers import SYSTEMS

TITLES = {
    "closed": "A sphere of 81,920 triangles from inside: rays lost",
    "moved": "Mesh and rays moved: rays lost",
    "scaled": "Mesh and rays scaled: rays lost",
    "slivers": "Slivers at grazing angles: false hits / false misses (beyond: the bound)",
    "degenerate": "No area, edge-on, coincident, along axes, from surfaces",
    "room": "A screw of 0.001 in a room of 10,000: rays that see the wrong one",
    "ends": "The ends of the formats",
}


CAPTION = (
    "ours: the golden model, whose bits are those of the Verilog, in the format of the command. "
    "Embree, robust, warp: in float32, as they are. Rays are aimed at what each system holds. "
    "as held: decisions against exact arithmetic on the numbers that a system rounded to; as "
    "given: on those before. beyond: wrong decisions of rays that pass no edge within the bound."
)


def grids(results: Sequence[dict]) -> list[Grid]:
    """A table for each case."""
    return [_grid(of["case"], of["rows"]) for of in results]


def caption(results: Sequence[dict]) -> str:
    """What the tables mean, and why a system refused; nothing without tables."""
    if not results:
        return ""
    found = [
        f"{SYSTEMS[system]} refused: {counts['refused']}."
        for of in results
        for row in of["rows"]
        for system, counts in row["found"].items()
        if "refused" in counts
    ]
    return " ".join([CAPTION, *dict.fromkeys(found)])


def _grid(case: str, rows: Sequence[dict]) -> Grid:
    there = [system for system in SYSTEMS if system in rows[0]["found"]]
    return Grid(
        TITLES[case],
        ("", "cases", *(SYSTEMS[system] for system in there), "verdict"),
        [
            (
                row["name"],
                f"{row['cases']:,}",
                *(_counts(row["found"].get(system), row["shown"]) for system in there),
                row["verdict"],
            )
            for row in rows
        ],
    )


def _counts(found: dict | None, shown: Sequence[str]) -> str:
    if found is None:
        return ""
    if "refused" in found:
        return "refused"
    return "/".join(f"{found[name]:,}" for name in shown or found)
