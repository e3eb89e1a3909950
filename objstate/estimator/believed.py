"""The beliefs about all objects while a log is read."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from zlib import crc32

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import Settings
from objstate.errors import BuildingError, SettingsError
from objstate.estimator.surroundings import Surroundings
from objstate.lazy import altered
from objstate.objects import ObjectBelief, ObjectFilter, filter_for
from objstate.objects.steps import remembered
from objstate.records import NANOSECONDS


class Believed:
    """The objects' beliefs."""

    def __init__(
        self,
        building: Building,
        settings: Settings,
        seed: int,
        known: Mapping[str, ObjectBelief],
        *,
        history: bool = False,
    ) -> None:
        self._settings, self._remembers = settings, history
        self.filters: dict[str, ObjectFilter] = {
            name: filter_for(item, settings) for name, item in building.objects.items()
        }
        self.rngs = {
            name: np.random.default_rng([seed, 1, crc32(name.encode())])
            for name in building.objects
        }
        self.surroundings = Surroundings(building)
        self.marginals: dict[str, ObjectBelief] = {}
        for name, each in self.filters.items():
            self._keep(name, each.prior(self.rngs[name]))
        self.priors: Mapping[str, ObjectBelief] = dict(self.marginals)  # before any scan
        _check_by_name(known)
        for name, belief in known.items():
            _check_known(belief, self.priors[building[name].name])
            self._keep(name, belief)

    def at(self, name: str, stamp_ns: int, rng: np.random.Generator | None = None) -> ObjectBelief:
        """p(s_i) <- integral of p(s_i | t, s_i') p(s_i'), t the time since the last update."""
        belief = self.marginals[name]
        seconds, now = _seconds(belief, stamp_ns), altered(belief, stamp_ns=stamp_ns)
        if seconds > 0.0:
            return self.filters[name].predict(now, seconds, rng or self.rngs[name])
        return now

    def then(self, name: str, stamp_ns: int) -> ObjectBelief:
        """An object's belief at a moment after its last update, without changing any state.

        Raises ValueError for an earlier moment, TypeError for one that is no integer.
        """
        if not isinstance(stamp_ns, int | np.integer):
            raise TypeError(f"The stamp {stamp_ns!r} is no integer; give nanoseconds since 1970.")
        belief = self.marginals[name]
        known = belief.stamp_ns
        if known is not None and stamp_ns < known:
            raise ValueError(
                f"Object '{name}' was updated after {stamp_ns} ns, at {known} ns; give a later stamp, "
                "in nanoseconds."
            )
        if stamp_ns != known:
            belief = self.at(name, stamp_ns, np.random.default_rng(stamp_ns))
        return belief

    def keep(self, beliefs: Iterable[tuple[str, ObjectBelief]]) -> None:
        """Keep new marginals."""
        for name, belief in beliefs:
            self._keep(name, remembered(belief) if self._remembers else belief)

    def restore(self, marginals: Mapping[str, ObjectBelief]) -> None:
        """Restore earlier beliefs."""
        for name, belief in marginals.items():
            if belief is not self.marginals[name]:
                self._keep(name, belief)

    def _keep(self, name: str, belief: ObjectBelief) -> None:
        before = self.marginals.get(name, belief)
        if belief.item is not before.item:
            self.filters[name] = filter_for(belief.item, self._settings)
            self.surroundings.rehang(belief.item)
        self.marginals[name] = belief
        self.surroundings.follow(name, belief)


def _check_by_name(known: object) -> None:
    """Raise TypeError for what isn't beliefs by name."""
    values = known.values() if isinstance(known, Mapping) else [known]
    for each in values:
        if not isinstance(each, ObjectBelief):
            raise TypeError(
                f"A {type(each).__name__} is no belief about an object; give a dict of beliefs by the "
                "objects' names, or what World.at returns."
            )


def _check_known(belief: ObjectBelief, prior: ObjectBelief) -> None:
    """Refuse a belief about another object, or a door's on another lattice, than its prior's.

    Raises BuildingError and SettingsError.
    """
    if belief.item.name != prior.item.name:
        raise BuildingError(
            f"The belief given for '{prior.item.name}' is about '{belief.item.name}'; give each by "
            "its object's name."
        )
    is_free = belief.item.kind is Kind.PLANAR
    if not is_free and not np.array_equal(belief.states, prior.states):
        raise SettingsError(
            f"The given belief about '{belief.item.name}' has {len(belief.states)} states, where "
            f"its settings need {len(prior.states)} between its limits; put it into a World with these "
            "settings, and give what World.at returns."
        )


def _seconds(belief: ObjectBelief, stamp_ns: int) -> float:
    """s since a belief's moment; 0 for one that has none yet."""
    return 0.0 if belief.stamp_ns is None else (stamp_ns - belief.stamp_ns) / NANOSECONDS
