"""What of a drive a world keeps: each object's belief when it was last seen, look by look."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

from objstate.objects import ObjectBelief
from objstate.world.changes import contradict

LOOK_ENDS_NS = 5_000_000_000  # without an observation for so long, the next one is another look
LOOK_LASTS_NS = 30_000_000_000  # of a longer look, a belief is kept for each such time


@dataclass(frozen=True, eq=False)
class _Look:
    """A time in which an object is observed again and again."""

    since_ns: int  # its begin, or the last belief of it that was kept
    reference: ObjectBelief  # what a belief must contradict for the object to have moved
    latest: ObjectBelief


class Looks:
    """Gathers beliefs while a drive goes on, and thins them.

    The belief at the end of a look holds all that it taught. Of a look in which the object
    is moved, the beliefs before and after are kept too, and of a long look one for every
    30 seconds.
    """

    def __init__(self, begin_ns: int) -> None:
        self._begin_ns = begin_ns
        self._kept: list[ObjectBelief] = []
        self._looks: dict[str, _Look] = {}

    def note(self, observed: Iterable[ObjectBelief]) -> None:
        """Record beliefs that a scan just observed, in time order."""
        for belief in observed:
            name = belief.item.name
            look = self._looks.get(name)
            self._looks[name] = _begun(belief) if look is None else self._continued(look, belief)

    def _continued(self, look: _Look, belief: ObjectBelief) -> _Look:
        """The look after another belief, or the next one."""
        now, before = _stamp(belief), _stamp(look.latest)
        if now - before > LOOK_ENDS_NS:
            self._kept.append(look.latest)
            return _begun(belief)
        if contradict(look.reference, belief):
            self._kept += [look.latest, belief]
            return _begun(belief)
        if now - look.since_ns > LOOK_LASTS_NS:
            self._kept.append(look.latest)
            return _Look(before, look.latest, belief)
        return replace(look, latest=belief)

    def take_back(self, since_ns: int, instead: Iterable[ObjectBelief]) -> None:
        """Forget what was learnt from a moment on; ``instead`` are the beliefs that hold again."""
        self._kept = [belief for belief in self._kept if _stamp(belief) < since_ns]
        self._looks = {
            belief.item.name: _begun(belief)
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


def ends_of_looks(beliefs: Iterable[ObjectBelief]) -> list[ObjectBelief]:
    """Of the beliefs of one object, in time order, the last of each look at it."""
    seen = [each for each in beliefs if each.last_observed_ns == each.stamp_ns is not None]
    ends = [now for now, then in pairwise(seen) if _stamp(then) - _stamp(now) > LOOK_ENDS_NS]
    return ends + seen[-1:]


def _begun(belief: ObjectBelief) -> _Look:
    return _Look(_stamp(belief), belief, belief)


def _stamp(belief: ObjectBelief) -> int:
    assert belief.stamp_ns is not None  # it was observed
    return belief.stamp_ns
