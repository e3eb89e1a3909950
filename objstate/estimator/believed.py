"""What is believed of every object while a log goes by, and a way back to what was."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from zlib import crc32

import numpy as np

from objstate.building.model import Building, MovableObject
from objstate.config import Settings
from objstate.errors import SettingsError
from objstate.estimator.surroundings import Surroundings
from objstate.lazy import altered
from objstate.objects import (
    SAME,
    ConditionalBelief,
    Descent,
    ObjectBelief,
    ObjectFilter,
    filter_for,
)
from objstate.records import NANOSECONDS


class Believed:
    """The objects' beliefs: marginals of all, and given each robot sample of those in view."""

    def __init__(
        self,
        building: Building,
        settings: Settings,
        seed: int,
        known: Mapping[str, ObjectBelief],
    ) -> None:
        self._settings = settings
        self.filters: dict[str, ObjectFilter] = {
            name: filter_for(item, settings) for name, item in building.objects.items()
        }
        self.rngs = {
            name: np.random.default_rng([seed, 1, crc32(name.encode())])
            for name in building.objects
        }
        self.surroundings = Surroundings(building)
        self.marginals: dict[str, ObjectBelief] = {}
        # given robot samples each, and how those of the last scan descend from them
        self._in_view: dict[str, tuple[ConditionalBelief, Descent]] = {}
        self._before: dict[str, ObjectBelief] = {}  # what changed since ``trust``, as it was
        self._earlier: dict[str, ObjectBelief] = {}  # what had changed since the one before
        for name, each in self.filters.items():
            self._keep(name, each.prior(self.rngs[name]))
        self.priors: Mapping[str, ObjectBelief] = dict(self.marginals)  # before any scan
        for name, belief in known.items():
            _check_samples(belief, self.priors[building[name].name])
            self._keep(name, belief)

    def at(self, name: str, stamp_ns: int, rng: np.random.Generator | None = None) -> ObjectBelief:
        """p(s_i) <- integral of p(s_i | t, s_i') p(s_i'), t the time since the last update."""
        belief = self.marginals[name]
        seconds, now = _seconds(belief, stamp_ns), altered(belief, stamp_ns=stamp_ns)
        if seconds > 0.0:
            return self.filters[name].predict(now, seconds, rng or self.rngs[name])
        return now

    def unmoved(self, name: str, stamp_ns: int, drift: float = 1.0) -> ObjectBelief:
        """Mean and deviations at a moment, for somebody who knows that the object wasn't moved since.

        The variance that ``drift`` adds counts by a factor.
        """
        belief = self.marginals[name]
        seconds = max(_seconds(belief, stamp_ns), 0.0)
        return belief.drifted(drift * self.filters[name].drift_variance(seconds))

    def given(
        self, name: str, samples: int, stamp_ns: int, drift: float = 1.0
    ) -> ConditionalBelief:
        """What is believed at a moment given each of so many robot samples.

        The variance that ``drift`` adds counts by a factor.
        """
        if name in self._in_view:
            known, descent = self._in_view[name]
        else:
            known, descent = ConditionalBelief.independent(self.marginals[name], samples), SAME
        seconds = _seconds(known.belief, stamp_ns)
        known = altered(known, belief=altered(known.belief, stamp_ns=stamp_ns))
        if seconds <= 0.0:
            return known.handed_on(descent)
        return self.filters[name].predict_each(known, seconds, self.rngs[name], descent, drift)

    def keep_in_view(
        self,
        given: Mapping[str, ConditionalBelief],
        descent: Descent = SAME,
        near: Collection[str] = (),
    ) -> None:
        """Keep the beliefs of the objects in view, and of those ``near``; of all others, marginals alone remain.

        The robot samples of the next scan descend from those of this one.
        """
        aside = {
            name: (known, before.then(descent))
            for name, (known, before) in self._in_view.items()
            if name in near and name not in given
        }
        self._in_view = aside | {name: (each, descent) for name, each in given.items()}
        self.keep({name: each.belief for name, each in given.items()}.items())

    def keep(self, beliefs: Iterable[tuple[str, ObjectBelief]]) -> None:
        """Keep new marginals."""
        for name, belief in beliefs:
            self._before.setdefault(name, self.marginals[name])
            self._keep(name, belief)

    def collapse(self) -> None:
        """Forget what each robot sample believes: the samples are others now."""
        self._in_view = {}

    def trust(self) -> None:
        """From now on, ``go_back`` leads to where this was last called before."""
        self._before, self._earlier = {}, self._before

    def trusted(self, name: str) -> ObjectBelief:
        """What was believed of an object when ``trust`` was called the last time but one."""
        return self._earlier.get(name) or self._before.get(name) or self.marginals[name]

    def go_back(self) -> list[MovableObject]:
        """Forget all that was learnt since the last but one ``trust``; which objects hang elsewhere by that."""
        before = self._before | self._earlier
        rehung = [
            belief.item
            for name, belief in before.items()
            if belief.item is not self.marginals[name].item
        ]
        for name, belief in before.items():
            self._keep(name, belief)
        self._before, self._earlier, self._in_view = {}, {}, {}
        return rehung

    def hang(self, belief: ObjectBelief) -> None:
        """Keep what is believed of a door that hangs elsewhere from now on."""
        self._in_view.pop(belief.item.name, None)
        self.keep([(belief.item.name, belief)])

    def _keep(self, name: str, belief: ObjectBelief) -> None:
        before = self.marginals.get(name, belief)
        if belief.item is not before.item:
            self.filters[name] = filter_for(belief.item, self._settings)
            self.surroundings.rehang(belief.item)
        self.marginals[name] = belief
        self.surroundings.follow(name, belief)


def _check_samples(belief: ObjectBelief, prior: ObjectBelief) -> None:
    """Raise SettingsError for a belief that isn't on such samples as an object's prior has."""
    if prior.scouts:
        serves = belief.scouts == prior.scouts < len(belief.states)
        given, needed = f"{belief.scouts} scouts", f"{prior.scouts}"
    else:
        serves = np.array_equal(belief.states, prior.states)
        given, needed = f"{len(belief.states)} states", f"{len(prior.states)} between its limits"
    if not serves:
        raise SettingsError(
            f"The belief given of '{belief.item.name}' has {given}, where its settings need "
            f"{needed}; put it into a World with these settings, and give what World.at returns."
        )


def _seconds(belief: ObjectBelief, stamp_ns: int) -> float:
    """s since a belief's moment; 0 for one that has none yet."""
    return 0.0 if belief.stamp_ns is None else (stamp_ns - belief.stamp_ns) / NANOSECONDS
