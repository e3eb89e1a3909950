"""Facts about a log that its user should know: each is reported once, with its count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import TypeVar

Item = TypeVar("Item")


class Notices:
    """Collects sentences and counts repeats."""

    def __init__(self) -> None:
        self._facts: Counter[str] = Counter()
        self.dropped: Counter[str] = Counter()  # what was dropped and why
        self._is_muted = False
        self._lasting: Counter[str] = Counter()

    def add(self, fact: str) -> None:
        """Note a fact: a sentence in the singular, e.g. ``"run.mcap is cut off"``."""
        if not self._is_muted:
            self._facts[fact] += 1

    def once(self, fact: str) -> None:
        """Note a fact that is found each time that a file is opened."""
        if not self._is_muted:
            self._facts[fact] = 1

    def drop(self, what: str, why: str) -> None:
        """Note that something was left out: ``drop("Scan", "before any odometry")``."""
        fact = f"{what} dropped: {why}"
        self.add(fact)
        if not self._is_muted:
            self.dropped[fact] += 1

    def keep(self) -> None:
        """From now on ``rewind`` goes back to what is noted so far."""
        self._lasting = self._facts.copy()

    def rewind(self) -> None:
        """Forget what was noted since ``keep``: the log is read once more."""
        self._facts = self._lasting.copy()
        self.dropped.clear()

    @contextmanager
    def muted(self) -> Iterator[None]:
        """While looking ahead, note nothing: it will be noted when it is read in its turn."""
        was_muted, self._is_muted = self._is_muted, True
        try:
            yield
        finally:
            self._is_muted = was_muted

    def muting(self, items: Iterable[Item]) -> Iterator[Item]:
        """The items; while one is made, nothing is noted."""
        made = iter(items)
        while True:
            with self.muted():
                try:
                    item = next(made)
                except StopIteration:
                    return
            yield item

    def sentences(self) -> str:
        """The facts as sentences, each with a blank before it."""
        return "".join(f" {fact}." for fact in self.listed())

    def listed(self) -> list[str]:
        """The facts in the order in which they first came up."""
        return [
            fact if count == 1 else f"{fact} ({count} times)" for fact, count in self._facts.items()
        ]
