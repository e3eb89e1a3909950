"""Where output goes: results to stdout, all else to stderr."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

# Columns assumed where no terminal says how wide it is: wide enough that no number of a
# table is ever cut off in a pipe or a file.
PIPE_WIDTH = 200


def print_text(text: str) -> None:
    """A result, to stdout, as it is."""
    print(text)


def print_table(table: Table) -> None:
    """A table, to stdout; in a pipe as wide as it needs."""
    from rich.console import Console

    width = None if sys.stdout.isatty() else PIPE_WIDTH
    Console(width=width, highlight=False).print(table)


def print_warnings(warnings: Iterable[str], quiet: bool) -> None:
    """Warnings, to stderr, unless ``quiet``."""
    if not quiet:
        for warning in warnings:
            print(f"warning: {warning}", file=sys.stderr)


def error_console() -> Console:
    """The terminal behind stderr, for what moves: the progress bar and the log of --verbose."""
    from rich.console import Console

    return Console(stderr=True, highlight=False)
