"""What a name that isn't known was meant to be."""

from __future__ import annotations

from collections.abc import Collection
from difflib import get_close_matches


def nearest(name: str, known: Collection[str]) -> str | None:
    """Of the ``known`` names the one that is spelt most like ``name``; None if none is near."""
    return next(iter(get_close_matches(name, known, n=1)), None)
