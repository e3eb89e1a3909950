"""Text from outside (names of topics, files and objects, messages of errors), made safe to print."""

from __future__ import annotations

import re

# what moves the cursor, recolours or retitles a terminal, turns the direction of writing, or has no
# bytes in any encoding (half a character of a file's name); lines and tabs are no harm in a
# sentence
UNPRINTABLE = re.compile(
    "[\\x00-\\x08\\x0b-\\x1f\\x7f-\\x9f\\u200e\\u200f\\u202a-\\u202e\\u2066-\\u2069\\ud800-\\udfff]"
)
LINES = re.compile(r"[\t\n\u2028\u2029]")


def plain(text: str) -> str:
    """The text with unprintable characters written out as escapes."""
    return UNPRINTABLE.sub(_written_out, text)


def plain_line(text: str) -> str:
    """The same in one line, for a cell of a table or a bar."""
    return LINES.sub(_written_out, plain(text))


def _written_out(found: re.Match[str]) -> str:
    return found.group().encode("unicode_escape").decode("ascii")
