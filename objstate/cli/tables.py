"""Tables that stay readable at 80 columns; numbers never wrap."""

from __future__ import annotations

import math
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


def significant(value: float, digits: int) -> str:
    """A number with some significant digits, without an exponent where people don't expect one."""
    if value == 0 or not 1e-6 <= abs(value) < 1e9:
        return f"{value:.{digits}g}"
    decimals = digits - 1 - math.floor(math.log10(abs(value)))
    text = f"{value:.{max(decimals, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def duration(seconds: float) -> str:
    """A time span in the unit that people would take."""
    for unit, size in (("d", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 1.5 * size:
            return f"{significant(seconds / size, 2)} {unit}"
    return f"{seconds:.0f} s"
