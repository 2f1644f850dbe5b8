"""What a study says: text, a diagram and tables; for terminals and for pages."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from rich.table import Table

from sim.console import table

if TYPE_CHECKING:  # not everyone has it
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Grid:
    """A table: its title, what its columns are called, and its cells."""

    title: str
    header: Sequence[str]
    cells: Sequence[Sequence[str]]

    def shown(self) -> Table:
        """For a terminal."""
        return table(self.title, self.cells, self.header)


@dataclass
class Section:
    """What is said on one scene.

    Attributes
    ----------
    name : str
        Of its files too.
    conclusion : str
    figure : matplotlib figure, optional
    tables : list of Grid
    notes : list of str
    """

    name: str
    conclusion: str
    figure: Figure | None
    tables: list[Grid] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
