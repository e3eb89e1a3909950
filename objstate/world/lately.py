"""Histories of which only the newest belief of each object is at hand; the rest is read when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from objstate.objects import ObjectBelief

History = tuple[ObjectBelief, ...]  # in time order


class Lately(Mapping[str, History]):
    """What was learnt of each object, by name; a planner needs but the last of it."""

    def __init__(
        self,
        stamps: Mapping[str, int],
        newest: Callable[[str], ObjectBelief],
        read: Callable[[str], History],
    ) -> None:
        self.stamps = stamps  # of the newest beliefs, by object
        self._read_newest = newest
        self._read = read
        self._newest: dict[str, ObjectBelief] = {}
        self._known: dict[str, History] = {}

    def newest(self, name: str) -> ObjectBelief | None:
        """The last belief of an object; None where nothing was learnt of it."""
        if name not in self.stamps:
            return None
        if name not in self._newest:
            self._newest[name] = self._read_newest(name)
        return self._newest[name]

    def __getitem__(self, name: str) -> History:
        if name not in self.stamps:
            raise KeyError(name)
        if name not in self._known:
            self._known[name] = self._read(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.stamps)

    def __len__(self) -> int:
        return len(self.stamps)
