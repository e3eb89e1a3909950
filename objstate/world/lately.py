"""Histories of which only the newest belief of each object is at hand; the rest is read when it is asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

from objstate.objects import ObjectBelief

History = tuple[ObjectBelief, ...]  # in time order


class Lately(Mapping[str, History]):
    """What was learnt of each object, by name; a planner needs but the last of it."""

    def __init__(self, newest: Mapping[str, ObjectBelief], read: Callable[[str], History]) -> None:
        self._newest = newest
        self._read = read
        self._known: dict[str, History] = {}

    def newest(self, name: str) -> ObjectBelief | None:
        """The last belief of an object; None where nothing was learnt of it."""
        return self._newest.get(name)

    def __getitem__(self, name: str) -> History:
        if name not in self._newest:
            raise KeyError(name)
        if name not in self._known:
            self._known[name] = self._read(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._newest)

    def __len__(self) -> int:
        return len(self._newest)
