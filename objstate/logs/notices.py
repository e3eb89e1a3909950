"""Facts about a log that its user should know: each is told once, with how often it was seen."""

from __future__ import annotations


class Notices:
    """Collects sentences and counts repeats."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}

    def add(self, fact: str) -> None:
        """Note a fact: a sentence in the singular, e.g. ``"Scan without odometry: dropped"``."""
        self._counts[fact] = self._counts.get(fact, 0) + 1

    def listed(self) -> list[str]:
        """The facts in the order in which they first came up."""
        return [
            fact if count == 1 else f"{fact} ({count} times)"
            for fact, count in self._counts.items()
        ]
