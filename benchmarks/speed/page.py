"""The parts of a page that a benchmark writes; all around them is kept."""

from __future__ import annotations

from pathlib import Path


def write(page: Path, part: str, text: str) -> None:
    """Put a text between ``<!-- part -->`` and ``<!-- /part -->``, in place of what is there.

    Raises ValueError for a page that doesn't hold these marks once each, in that order.
    """
    begin, end = f"<!-- {part} -->", f"<!-- /{part} -->"
    content = page.read_text(encoding="utf-8")
    before, found, rest = content.partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed) or begin in rest or end in after:
        raise ValueError(f"{page} must hold {begin} and {end} once each, in that order")
    page.write_text(f"{before}{begin}\n\n{text}\n\n{end}{after}", encoding="utf-8")
