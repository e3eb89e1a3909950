"""Tables that stay readable at 80 columns; numbers never wrap."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


def new_table(title: str, labels: tuple[str, ...], numbers: tuple[str, ...]) -> Table:
    """A table with columns of text, which fold when they must, then columns of numbers."""
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    for label in labels:
        table.add_column(label, overflow="fold")
    for number in numbers:
        table.add_column(number, justify="right", no_wrap=True)
    return table


def percent(share: float) -> str:
    """A share of one as whole percents."""
    return f"{100 * share:.0f}"
