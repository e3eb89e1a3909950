"""A rich console that prints text as it is: square brackets and colons mean nothing in it."""

from __future__ import annotations

import logging
from typing import IO, Any

from rich.console import Console
from rich.text import Text

from objstate.cli.plain import plain


class PlainConsole(Console):
    """Prints strings without markup, emoji or control characters; styles come from the program alone."""

    def __init__(self, file: IO[str] | None = None, width: int | None = None) -> None:
        super().__init__(
            file=file, stderr=file is None, width=width, markup=False, emoji=False, highlight=False
        )

    def render_str(self, text: str, **options: Any) -> Text:
        """Convert strings as rich does, also in tables."""
        return super().render_str(plain(text), **options)


class PlainFormatter(logging.Formatter):
    """Log lines without control characters."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        return plain(super().format(record))
