"""What commands show: progress, tables, and what is wrong."""

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from textwrap import fill

from rich import box
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn
from rich.table import Table

from sim.command import close_stdout
from sim.files import write_json


def progress() -> Progress:
    """Progress on standard error; none where that is no terminal."""
    console = Console(stderr=True)
    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )


def table(title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> Table:
    """A table whose first column is names and whose others are figures."""
    shown = Table(
        title=title,
        title_justify="left",
        box=box.SIMPLE,
        collapse_padding=True,
        show_header=bool(header),
        min_width=min(len(title), 80),
    )
    rows = [tuple(row) for row in rows]
    for column in range(len(rows[0])):
        name = header[column] if header else ""
        shown.add_column(name, justify="left" if column == 0 else "right", overflow="fold")
    for row in rows:
        shown.add_row(*row)
    return shown


class _Console(Console):
    """One that goes on where the reader of a pipe has seen enough: files are yet to be written."""

    def on_broken_pipe(self):
        close_stdout()


def print_tables(*tables):
    """Print tables, no wider than 80 columns even into a pipe."""
    console = _Console(highlight=False)
    width = min(console.width, 80) if console.is_terminal else 80
    console.width = width
    console.print(*tables, sep="", width=width)


def print_text(text: str):
    """Print a paragraph in lines of at most 80 columns."""
    try:
        print(fill(text, 80, break_long_words=False, break_on_hyphens=False), flush=True)
    except BrokenPipeError:
        close_stdout()


def conclude(tables: Iterable, json: Path | None, figures: dict, mismatches: Sequence[str]):
    """Write figures to a file if there is one, print tables, and say on stderr what is wrong."""
    write_json(json, figures)
    print_tables(*tables)
    for line in mismatches:
        print(line, file=sys.stderr)
