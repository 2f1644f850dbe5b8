"""What commands show and write: progress, tables, figures."""

import json
import os
import tempfile
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from sim.errors import InputError


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


def print_tables(*tables):
    """Print tables, no wider than 80 columns even into a pipe."""
    console = Console(highlight=False)
    width = min(console.width, 80) if console.is_terminal else 80
    console.print(*tables, sep="", width=width)


def check_writable(*files: Path | None):
    """Refuse files that cannot be written, before the work and not after it."""
    for file in files:
        if file and (file.is_dir() or not os.access(file.absolute().parent, os.W_OK)):
            raise InputError(f"{file}: cannot be written; name a file in a folder that exists")


def write_json(file: Path | None, figures: dict):
    """Write figures whole or not at all."""
    if file:
        with tempfile.TemporaryDirectory(dir=file.absolute().parent) as folder:
            temporary = Path(folder) / file.name
            temporary.write_text(json.dumps(figures, indent=1) + "\n")
            temporary.replace(file)
