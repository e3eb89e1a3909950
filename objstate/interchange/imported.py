"""The result of an import: buildings, and lists of what was taken and what wasn't."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from itertools import chain, count

from objstate.building.model import Building


@dataclass(frozen=True)
class Notes:
    """Sentences about what of a file was taken and what was left, in the order of the file."""

    taken: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    doubts: list[str] = field(default_factory=list)  # what to check before the result is used


@dataclass(frozen=True, eq=False)
class Imported:
    """The floors of a file, each a building of its own, by name."""

    floors: Mapping[str, Building]
    notes: Notes
    sidecars: Mapping[str, str] = field(default_factory=dict)  # of some floors


def tell_renamed(notes: Notes, before: str, after: str) -> None:
    """Note that something has another name than before, if it has."""
    if after != before:
        notes.doubts.append(f"'{before}' is called '{after}' in what was written.")


def several(count: int, one: str, many: str | None = None) -> str:
    """A count with its noun."""
    return f"{count} {one if count == 1 else many or one + 's'}"


def file_name(text: str) -> str:
    """A name for a file or folder: letters, digits, blanks, points, hyphens; no point leads."""
    return re.sub(r"[^\w .-]", "_", text).strip(" .") or "unnamed"


def unused_name(name: str, taken: Container[str]) -> str:
    """A name, with a number where it is taken."""
    numbered = (f"{name}_{number}" for number in count(2))
    return next(each for each in chain([name], numbered) if each not in taken)
