"""Results as sections of a report."""

from collections.abc import Sequence

from sim.study.precision import tables
from sim.study.precision.conclusion import conclusion
from sim.study.precision.figure import formats_figure
from sim.study.precision.rows import measured
from sim.study.precision.updates import UPDATES, updates_conclusion, updates_table
from sim.study.precision.updates_figure import updates_figure
from sim.study.section import Grid, Section


def formats_section(name: str, rows: Sequence[dict]) -> Section:
    """Formats on one scene, of sim.study.precision.rows; `name` is that of the picture's files."""
    scene = rows[0]["scene"]
    known = measured(rows)
    return Section(
        name,
        conclusion(rows),
        formats_figure(rows) if known else None,
        [
            Grid(f"{scene}: errors", tables.ERRORS, tables.error_table(rows)),
            Grid(f"{scene}: costs", tables.COSTS, tables.cost_table(rows)),
        ][: 2 if known else 1],
        tables.refusals(rows),
    )


def updates_section(name: str, rows: Sequence[dict]) -> Section:
    """Policies on one scene, of sim.study.precision.updates: the first updates every frame."""
    scene = rows[0]["scene"]
    known = [row for row in rows if "refused" not in row]
    notes = [f"{row['policy']} refused: {row['refused']}" for row in rows if "refused" in row]
    if not known:
        return Section(name, f"{scene}: no policy runs.", None, [], notes)
    grid = Grid(
        f"{scene}: million cycles of {len(known[0]['frames'])} frames",
        UPDATES,
        updates_table(known),
    )
    return Section(name, updates_conclusion(known), updates_figure(known), [grid], notes)
