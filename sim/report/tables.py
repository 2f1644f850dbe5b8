"""Reports as tables of at most 80 columns."""

from collections.abc import Iterable, Sequence

from rich import box
from rich.table import Table

from sim.report.update import UpdateReport


def table(title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> Table:
    """A table whose first column is names and whose others are figures."""
    shown = Table(title=title, title_justify="left", box=box.SIMPLE, show_header=bool(header))
    rows = [tuple(row) for row in rows]
    for column in range(len(rows[0])):
        name = header[column] if header else ""
        shown.add_column(name, justify="left" if column == 0 else "right", overflow="fold")
    for row in rows:
        shown.add_row(*row)
    return shown


def update_tables(report: UpdateReport) -> list[Table]:
    """What `bkd-sim update` prints."""
    work = report.triangles * len(report.frames)
    per_triangle = [("instructions", report.instructions_per_triangle)]
    per_triangle += [
        (f"waiting: {CAUSES[cause]}", count / work) for cause, count in report.stall_cycles.items()
    ]
    run = [
        ("triangles, vertices", f"{report.triangles:,}, {report.vertices:,}"),
        ("frames", f"{len(report.frames)} ({report.frames[0]} to {report.frames[-1]})"),
        ("words checked that differ from the model", f"{report.mismatches:,}"),
        ("loads a triangle", f"{report.loads_per_triangle:.3f}"),
        ("memory words a triangle", f"{report.memory_words_per_triangle:.3f}"),
        ("SAH cost against a rebuild, worst frame", f"{max(report.sah_ratio):.3f}"),
        ("tree built in", f"{report.build_seconds:.3f} s"),
        ("program compiled in", f"{report.compile_seconds:.3f} s"),
        ("simulated cycles a second", f"{report.simulated_cycles_per_second:,.0f}"),
    ]
    title = f"{report.scene}: float {report.format}, memory latency {report.latency} cycles"
    return [
        table(title, run),
        table(
            "Where the cycles go",
            [(name, f"{value:.4f}") for name, value in per_triangle]
            + [("in all", f"{report.cycles_per_triangle:.4f}"), ("the 2006 board", "4.1")],
            header=("", "cycles a triangle"),
        ),
    ]


CAUSES = {
    "fetch": "for the next instruction",
    "vertex": "for a vertex that is being loaded",
    "box": "for a box that is being merged",
    "load": "for the memory port, to load",
    "write": "for the memory port, to write nodes",
    "drain": "for the last nodes to be written",
}
