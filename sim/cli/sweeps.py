"""Sweeps of a command: where they run, and their progress."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sim.command import Parser
from sim.console import progress
from sim.study.sweep import Work, sweep

Sweep = Callable[[str, Work, list[dict]], list[dict]]


def scheduler_argument(parser: Parser):
    """Where the sweeps run."""
    text = "of a Dask cluster; all cores of this machine"
    parser.add_argument("--scheduler", metavar="ADDRESS", help=text)


@contextmanager
def sweeps(scheduler: str | None) -> Iterator[Sweep]:
    """A function that sweeps with progress, of what to call it, the work and its cells."""
    with progress() as bar:
        task = bar.add_task("", total=None)

        def swept(what: str, work: Work, cells: list[dict]) -> list[dict]:
            bar.update(task, description=what, total=len(cells), completed=0)
            return sweep(
                work,
                cells,
                scheduler=scheduler,
                done=lambda count: bar.update(task, completed=count),
            )

        yield swept
