"""Tables of words and figures, for people: on the screen and as Markdown."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Table:
    """Cells as they are read."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]  # each as long as the columns
    note: str = ""

    def markdown(self) -> str:
        """The table under its title."""
        lines = [self.columns, ("---",) * len(self.columns), *self.rows]
        table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
        note = f"\n\n{self.note}" if self.note else ""
        return f"## {self.title}\n\n{table}{note}\n"


def figure(value: float, decimals: int = 2) -> str:
    """A number to some decimals; a dash for none."""
    return f"{value:z.{decimals}f}" if np.isfinite(value) else "-"


def percent(flags: Iterable[bool]) -> str:
    """The share of what is true; a dash of nothing."""
    values = list(flags)
    return f"{100 * np.mean(values):.0f} %" if values else "-"


def mean(values: Iterable[float]) -> float:
    """The mean; nan of nothing."""
    listed = list(values)
    return float(np.mean(listed)) if listed else float("nan")


def rms(values: Iterable[float]) -> float:
    """Root of the mean square; nan of nothing."""
    listed = np.array(list(values))
    return float(np.sqrt(np.mean(listed**2))) if len(listed) else float("nan")
