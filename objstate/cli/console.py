"""Where output goes: results to stdout, all else to stderr."""

from __future__ import annotations

import logging
import os
import sys
from collections.abc import Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING

from objstate.cli.plain import plain

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

# Columns assumed where no terminal says how wide it is: wide enough that no number of a
# table is ever cut off in a pipe or a file.
PIPE_WIDTH = 200


def print_text(text: str) -> None:
    """A result, to stdout."""
    _write(plain(text) + "\n")


def print_table(table: Table) -> None:
    """A table, to stdout; as wide as it needs where the terminal is too narrow for its words."""
    from objstate.cli.plain_console import PlainConsole

    console = PlainConsole(sys.stdout, None if sys.stdout.isatty() else PIPE_WIDTH)
    wide = console.options.update(width=PIPE_WIDTH)
    for column in table.columns:
        parts = [console.measure(cell, options=wide) for cell in (column.header, *column.cells)]
        column.min_width = max(part.maximum if column.no_wrap else part.minimum for part in parts)
    console.width = max(console.width, console.measure(table, options=wide).minimum)
    with console.capture() as capture:
        console.print(table)
    _write(capture.get())


def print_parts(parts: Iterable[str | Table]) -> None:
    """A description of text and tables, to stdout."""
    for part in parts:
        if isinstance(part, str):
            print_text(part)
        else:
            print_table(part)


def print_names(label: str, names: Iterable[str]) -> None:
    """What is true of some objects, to stdout; nothing where there are none."""
    listed = ", ".join(sorted(names))
    if listed:
        print_text(f"{label}: {listed}")


def print_problems(problems: Sequence[str]) -> None:
    """What is wrong with an input, to stdout, one problem a line."""
    if not problems:
        print_text("No problems found.")
    print_list("Problems:", problems)


def print_list(title: str, lines: Sequence[str]) -> None:
    """Sentences below a title, to stdout; nothing where there are none."""
    if lines:
        print_text(title)
    for line in lines:
        print_text(f"- {line}")


def _write(text: str) -> None:
    """Write to stdout; a closed pipe, as in ``objstate inspect LOG | head``, is no error."""
    encoding = sys.stdout.encoding or "utf-8"
    try:
        sys.stdout.write(text.encode(encoding, "backslashreplace").decode(encoding))
        sys.stdout.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_warnings(warnings: Iterable[str], quiet: bool) -> None:
    """Warnings, to stderr, unless ``quiet``."""
    if not quiet:
        for warning in warnings:
            print_notice(f"warning: {warning}")


def print_notice(text: str) -> None:
    """A line that is no result, to stderr."""
    print(plain(text), file=sys.stderr)


def print_errors(errors: Iterable[str]) -> None:
    """Why a result is no success, to stderr."""
    for error in errors:
        print(f"error: {error}", file=sys.stderr)


@cache
def error_console() -> Console:
    """The terminal behind stderr; one, so that a log line doesn't break the progress bar."""
    from objstate.cli.plain_console import PlainConsole

    return PlainConsole()


def log_to_terminal() -> None:
    """Show on stderr what the library logs, as --verbose asks."""
    from rich.highlighter import NullHighlighter
    from rich.logging import RichHandler

    from objstate.cli.plain_console import PlainFormatter

    handler = RichHandler(console=error_console(), show_path=False, highlighter=NullHighlighter())
    handler.setFormatter(PlainFormatter("%(message)s"))
    logging.basicConfig(level=logging.INFO, handlers=[handler])
