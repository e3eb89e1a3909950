"""Whether the robot is where it thinks it is, kept apart from whether the world has changed."""

from __future__ import annotations

from objstate.config import LocalizationSettings
from objstate.estimator.tracking import NANOSECONDS


class Doubt:
    """The record of a robot's being lost: since when, how often before, when to search next.

    Each search that finds nothing better doubles the wait for the next: then it is
    the world that has changed, or the laser that sees through glass.
    """

    def __init__(self, settings: LocalizationSettings) -> None:
        self._settings = settings
        self._past: list[tuple[int, int]] = []
        self._fitted_ns = 0  # the last moment at which the track surely fitted
        self._search_from_ns = 0
        self._wait = settings.lost_after  # s
        self.is_lost = False

    def stretches(self, now_ns: int) -> tuple[tuple[int, int], ...]:
        """(from, to) ns of each time that the robot was lost, the present one up to now."""
        present = [(self._fitted_ns, now_ns)] if self.is_lost else []
        return (*self._past, *present)

    def may_search(self, now_ns: int) -> bool:
        """Whether a search isn't pointless so soon after the last."""
        return now_ns >= self._search_from_ns

    def rise(self) -> None:
        """The track doesn't fit any more."""
        self.is_lost = True

    def dispel(self, now_ns: int) -> None:
        """The track fits."""
        self._end(now_ns)
        self._fitted_ns = now_ns
        self._search_from_ns, self._wait = 0, self._settings.lost_after

    def found(self, now_ns: int) -> None:
        """The robot was found in another place."""
        self._end(now_ns)

    def settle(self, now_ns: int) -> None:
        """No place fits better: the robot is where it thought, and the world has changed."""
        self.is_lost = False
        self._wait *= 2.0
        self._search_from_ns = now_ns + int(self._wait * NANOSECONDS)

    def _end(self, now_ns: int) -> None:
        if self.is_lost:
            self._past.append((self._fitted_ns, now_ns))
        self.is_lost = False
