"""How far a transfer is: bytes, bytes a second and the time left, on standard error."""

from rich.console import Console
from rich.progress import (
    BarColumn,
    DownloadColumn,
    Progress,
    TextColumn,
    TimeRemainingColumn,
    TransferSpeedColumn,
)


class Meter:
    """Shows what goes on; nothing where standard error is no terminal. A context manager."""

    def __init__(self):
        console = Console(stderr=True)
        self._bar = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            DownloadColumn(),
            TransferSpeedColumn(),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )
        self._task = self._bar.add_task("opening the port", total=None)
        self._total = 0

    def __enter__(self):
        self._bar.start()
        return self

    def __exit__(self, *_):
        self._bar.stop()

    def step(self, text: str):
        """What begins."""
        self._bar.update(self._task, description=text)

    def begin(self, text: str, total: int):
        """What begins, and how many bytes it moves."""
        self._total = total
        self._bar.reset(self._task, total=total, description=text)

    def less(self, count: int):
        """So many bytes need not be moved."""
        self._total -= count
        self._bar.update(self._task, total=self._total)

    def moved(self, count: int):
        """So many more bytes are there."""
        self._bar.advance(self._task, count)
