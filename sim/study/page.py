"""One page of HTML that holds it all, and asks for nothing from the network."""

import base64
import io
from collections.abc import Sequence
from html import escape

import matplotlib
from matplotlib.figure import Figure

from sim.study.provenance import line
from sim.study.section import Grid, Section

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 860px; margin: 2em auto; padding: 0 1em }
img { width: 100% } table { border-collapse: collapse; font-size: 13px; margin: 1em 0 }
th, td { padding: 2px 8px; text-align: right; border-bottom: 1px solid #ddd }
th:first-child, td:first-child { text-align: left } pre { font-size: 12px; overflow: auto }
"""


def page(title: str, sections: Sequence[Section], caption: str, of: dict) -> str:
    """The page; `caption` says what columns mean, `of` is sim.study.provenance.provenance."""
    parts = [f"<h1>{escape(title)}</h1>"]
    for section in sections:
        parts.append(f"<h2>{escape(section.name)}</h2><p>{escape(section.conclusion)}</p>")
        if section.figure:
            data = base64.b64encode(picture(section.figure, "svg", line(of))).decode()
            text = escape(section.conclusion)
            parts.append(f'<img alt="{text}" src="data:image/svg+xml;base64,{data}">')
        parts += [_table(grid) for grid in section.tables]
        parts += [f"<p>{escape(note)}</p>" for note in section.notes]
    parts.append(f"<p>{escape(caption)}</p>")
    again = line(of).replace("; ", "\n").replace(", ", "\n")
    parts.append(f"<h2>How to get it again</h2><pre>{escape(again)}</pre>")
    body = "\n".join(parts)
    return (
        f'<!doctype html>\n<html lang="en"><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{STYLE}</style>\n{body}\n</html>\n"
    )


def picture(figure: Figure, kind: str, description: str) -> bytes:
    """A figure as svg or png with a description in it: the same bytes each time."""
    held = io.BytesIO()
    undated = {"Date": None} if kind == "svg" else {}
    with matplotlib.rc_context({"svg.hashsalt": "bkdtree"}):
        metadata = {"Description": description, **undated}
        figure.savefig(held, format=kind, dpi=200, metadata=metadata)
    return held.getvalue()


def _table(grid: Grid) -> str:
    rows = [_row("th", grid.header), *(_row("td", cells) for cells in grid.cells)]
    return f"<h3>{escape(grid.title)}</h3><table>{''.join(rows)}</table>"


def _row(kind: str, cells: Sequence[str]) -> str:
    return "<tr>" + "".join(f"<{kind}>{escape(cell)}</{kind}>" for cell in cells) + "</tr>"
