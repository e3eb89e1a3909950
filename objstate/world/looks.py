"""What of a drive a world keeps: each object's belief when it was last seen, look by look."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from objstate.objects import ObjectBelief

LOOK_ENDS_NS = 5_000_000_000  # without an observation for so long, the next one is another look
LOOK_LASTS_NS = 30_000_000_000  # of a longer look, a belief is kept for each such time


@dataclass(frozen=True, eq=False)
class _Look:
    """A time in which an object is observed again and again."""

    since_ns: int  # its begin, or the last belief of it that was kept
    latest: ObjectBelief


class Looks:
    """Gathers beliefs while a drive goes on, and thins them.

    The belief at the end of a look holds all that it taught. A long look leaves one for
    every 30 seconds too, so that history shows what was moved meanwhile.
    """

    def __init__(self, begin_ns: int) -> None:
        self._begin_ns = begin_ns
        self._kept: list[ObjectBelief] = []
        self._looks: dict[str, _Look] = {}

    def note(self, observed: Iterable[ObjectBelief]) -> None:
        """Take note of beliefs that a scan just bore on, in time order."""
        for belief in observed:
            name, now = belief.item.name, _stamp(belief)
            look = self._looks.get(name, _Look(now, belief))
            if now - _stamp(look.latest) > LOOK_ENDS_NS:
                self._kept.append(look.latest)
                look = _Look(now, belief)
            elif now - look.since_ns > LOOK_LASTS_NS:
                self._kept.append(look.latest)
                look = _Look(_stamp(look.latest), belief)
            self._looks[name] = _Look(look.since_ns, belief)

    def take_back(self, since_ns: int, instead: Iterable[ObjectBelief]) -> None:
        """Forget what was learnt from a moment on; ``instead`` are the beliefs that hold again."""
        self._kept = [belief for belief in self._kept if _stamp(belief) < since_ns]
        self._looks = {
            belief.item.name: _Look(_stamp(belief), belief)
            for belief in instead
            if belief.last_observed_ns is not None and belief.last_observed_ns >= self._begin_ns
        }

    @property
    def beliefs(self) -> list[ObjectBelief]:
        """All that is worth keeping, by object and time."""
        by_moment = {
            (belief.item.name, _stamp(belief)): belief
            for belief in (*self._kept, *(look.latest for look in self._looks.values()))
        }
        return [by_moment[moment] for moment in sorted(by_moment)]


def _stamp(belief: ObjectBelief) -> int:
    assert belief.stamp_ns is not None  # it was observed
    return belief.stamp_ns
