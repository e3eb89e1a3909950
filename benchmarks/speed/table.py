"""Tables of figures, as they are printed and as they stand in the docs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from textwrap import fill

WIDTH = 100  # characters of a line of docs


@dataclass(frozen=True)
class Table:
    """A table in Markdown, with what has to be known to read it."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = field(default=())

    def markdown(self) -> str:
        lines = [f"### {self.title}", ""]
        lines += [_row(self.header), _row(["---"] * len(self.header)), *map(_row, self.rows)]
        for note in self.notes:
            lines += ["", wrapped(note)]
        return "\n".join(lines)


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def number(value: float) -> str:
    """Three digits that count."""
    if value == 0.0:
        return "0"
    if abs(value) >= 100.0:
        return f"{value:,.0f}"
    return f"{value:.3g}" if abs(value) >= 1e-3 else f"{value:.0e}"


def milliseconds(seconds: float) -> str:
    return f"{number(1e3 * seconds)} ms"


def times(ratio: float) -> str:
    return f"{number(ratio)} ×"


def wrapped(text: str) -> str:
    """A paragraph in lines of at most ``WIDTH`` characters."""
    return fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)
