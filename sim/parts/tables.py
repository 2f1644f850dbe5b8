"""How a scene is divided, as figures and as text of at most 80 columns."""

from collections.abc import Sequence
from dataclasses import asdict

from rich.table import Table

from sim.console import table
from sim.parts.costs import Cost, Costs
from sim.parts.part import Analysis, Kind, Part
from sim.scene.scene import Scene

ROWS = 12
"""Parts that have a row of their own, the largest; of others all of a kind have one."""
HEADER = ("part", "kind", "pieces", "triangles", "error", "words", "instr.", "chosen")
CHOSEN = {
    Kind.STATIC: "nothing",
    Kind.STRUCTURED: "instance",
    Kind.CONTINUOUS: "refit",
    Kind.UNSTRUCTURED: "rebuild",
}


def chosen(part: Part) -> str:
    """What is done for a part in each frame."""
    return CHOSEN[part.kind] if part.shares is None else f"copy of {part.shares}"


def figures(scene: Scene, analysis: Analysis, costs: Costs) -> dict:
    """All that is known, for JSON; transforms and lists of triangles are left out."""
    rows = []
    for k, (part, cost) in enumerate(zip(analysis.parts, costs.parts, strict=True)):
        rebuild = costs.rebuilds.get(k)
        rows.append({
            "kind": str(part.kind),
            "first_triangle": int(part.faces[0]),
            "triangles": len(part.faces),
            "vertices": len(part.vertices),
            "pieces": part.pieces,
            "residual": part.residual,
            "shares": part.shares,
            "ratio": part.ratio,
            "fails_from": part.fails_from,
            "rebuild": rebuild and asdict(rebuild),
            "chosen": chosen(part),
            **asdict(cost),
        })
    return {
        "scene": scene.name,
        "triangles": len(scene.faces),
        "frames": list(analysis.frames),
        "error": analysis.error,
        "factor": analysis.factor,
        "parts": rows,
        "whole": asdict(costs.whole),
        "divided": asdict(costs.divided),
    }


def parts_table(scene: Scene, analysis: Analysis, costs: Costs) -> Table:
    """What `bkd-sim analyse` prints: words and instructions are those of a frame."""
    parts = list(zip(range(len(analysis.parts)), analysis.parts, costs.parts, strict=True))
    largest = sorted(parts, key=lambda row: (-len(row[1].faces), row[0]))
    # One more than ROWS would be a row of others that stands for one part only.
    own = sorted(largest if len(parts) <= ROWS + 1 else largest[:ROWS])
    rest = [row for row in parts if row not in own] if len(own) < len(parts) else []
    rows = [_row(str(k), chosen(part), [(part, cost)]) for k, part, cost in own]
    for kind in Kind:
        others = [(part, cost) for _, part, cost in rest if part.kind is kind]
        if others:
            rows.append(_row(f"+{len(others)}", CHOSEN[kind], others))
    frames = analysis.frames
    title = f"{scene.name}: {len(scene.faces):,} triangles, frames {frames[0]} to {frames[-1]}"
    return table(title, rows, HEADER)


def _row(name: str, does: str, some: Sequence[tuple[Part, Cost]]) -> tuple[str, ...]:
    moving = some[0][0].kind is not Kind.STATIC
    return (
        name,
        str(some[0][0].kind),
        f"{sum(part.pieces for part, _ in some):,}",
        f"{sum(len(part.faces) for part, _ in some):,}",
        f"{max(part.residual for part, _ in some):.0e}" if moving else "0",
        f"{sum(cost.words for _, cost in some):,.0f}",
        f"{sum(cost.instructions for _, cost in some):,}",
        does,
    )


def conclusions(analysis: Analysis, costs: Costs) -> list[str]:
    """What follows, in a sentence each."""
    whole, divided = costs.whole, costs.divided
    if not whole.instructions:
        return ["Nothing moves: the tree is written once, with its bounds."]
    lines = [
        f"A frame, whole: {whole.words:,.0f} words and {whole.instructions:,} instructions; "
        f"divided: {divided.words:,.0f} words and {divided.instructions:,} instructions."
    ]
    for k, rebuild in costs.rebuilds.items():
        lines.append(
            f"Part {k}: refit fails from frame {analysis.parts[k].fails_from}; a rebuild costs "
            f"{rebuild.milliseconds:,.1f} ms on the host and {rebuild.words:,} words instead."
        )
    return lines
