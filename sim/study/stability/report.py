"""Results as sections of a report."""

from collections.abc import Sequence

from sim.study.motion import tables as motion
from sim.study.motion.plot import figure
from sim.study.section import Section
from sim.study.stability import tables


def sections(results: Sequence[dict], motions: Sequence[dict]) -> list[Section]:
    """Of sim.study.stability.cases and sim.study.motion.measure: tables, then a scene each."""
    found = (
        [Section("stability", tables.caption(results), None, tables.grids(results))]
        if results
        else []
    )
    if motions:
        text = motion.caption(motions) or ""
        found.append(Section("motion", text, None, motion.grids(motions)))
    for result in motions:
        if "refused" not in result:
            name = f"motion-{result['scene'].partition(':')[0]}"
            found.append(Section(name, motion.sentence(result), figure(result)))
    return found
