"""The tables of experiments."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING

from objstate.cli.console import print_table, print_text
from objstate.cli.tables import new_table

if TYPE_CHECKING:
    from objstate.experiments import Table

WIDTH = 80  # of notes, characters


def print_experiment(table: Table) -> None:
    """A table with its title and note, to stdout; its headings fold, its cells don't."""
    shown = new_table(table.title, (), ())
    for number, heading in enumerate(table.columns):
        shown.add_column(heading, justify="right" if number else "left")
    for row in table.rows:
        shown.add_row(*(cell.replace(" ", "\u00a0") for cell in row))
    print_table(shown)
    if table.note:
        print_text(textwrap.fill(table.note, WIDTH) + "\n")
