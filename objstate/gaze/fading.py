"""How long information about an object lasts without a look at it.

A nat learnt about a door that is moved every few minutes is soon lost again; a nat learnt about one
that hardly ever moves lasts all day. So a look is worth not its gain, but the sum of the times that
its nats last: nat hours. Of all objects that become uncertain again after every look, choosing
those whose last nats have lasted longest per metre of way minimizes the mean entropy for the
distance driven: it is Whittle's index of an object that fades with its age (Tripathi and Modiano
2019, "A Whittle index approach to minimizing functions of age of information").
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import Settings
from objstate.gaze.entropy import belief_entropy
from objstate.gaze.floor import leaf_ends
from objstate.geometry import FloatArray
from objstate.lazy import lazy
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights
from objstate.units import SECONDS_PER_HOUR

FIRST, LAST = 1.0 / 60.0, 24.0  # h, the ages between which fading is followed
AGES = np.append(0.0, np.geomspace(FIRST, LAST, 40))  # h
SAMPLES = 4000  # of furniture that fades


@dataclass(frozen=True, eq=False)
class Fading:
    """The entropy of an object's belief by the time since a complete look."""

    ages: FloatArray = field(repr=False)  # (k,) h
    entropies: FloatArray = field(repr=False)  # (k,) nats, never falling

    @staticmethod
    def of(item: MovableObject, settings: Settings, std_m: float, std_rad: float) -> Fading:
        """For an object that is known to these deviations, m and rad, after a look."""
        known, rng = _known(item, settings, std_m, std_rad), np.random.default_rng(0)
        predict = filter_for(item, settings).predict
        later = [belief_entropy(predict(known, age * SECONDS_PER_HOUR, rng)) for age in AGES]
        return Fading(AGES, np.maximum.accumulate(later))

    def worth(self, entropy: float, gain: float) -> float:
        """How long the nats of a look last, nat hours, for a gain from an entropy, nats.

        A nat lasts until the object's dynamics have removed it again: the integral of that time
        over the entropies from after the look to before it.
        """
        before, after = (self._served(nats) for nats in (entropy, entropy - gain))
        return before - after

    def _served(self, entropy: float) -> float:
        """Nat hours below an entropy."""
        beyond = max(entropy - float(self.entropies[-1]), 0.0)
        served = float(np.interp(entropy, self.entropies, self._filled))
        return served + beyond * float(self.ages[-1])

    @lazy
    def _filled(self) -> FloatArray:
        """(k,) nat hours below each of the entropies."""
        lasting = (self.ages[1:] + self.ages[:-1]) / 2.0
        return np.append(0.0, np.cumsum(np.diff(self.entropies) * lasting))


def fadings(
    objects: Mapping[str, MovableObject], settings: Settings, std_m: float, std_rad: float
) -> dict[str, Fading]:
    """Of each object; those that fade alike are followed once."""
    known: dict[tuple[object, ...], Fading] = {}
    found = {}
    for name, item in objects.items():
        of = settings.for_object(name, "furniture" if item.kind is Kind.PLANAR else "door")
        key = (of.model_dump_json(), *_shape(item))
        if key not in known:
            known[key] = Fading.of(item, settings, std_m, std_rad)
        found[name] = known[key]
    return found


def _shape(item: MovableObject) -> tuple[object, ...]:
    """What of an object, besides its settings, says how its belief fades."""
    if item.kind is Kind.PLANAR:
        return (item.kind, item.symmetry.order)
    return (item.kind, item.lower, item.upper, float(item.home[0]), _length(item))


def _known(item: MovableObject, settings: Settings, std_m: float, std_rad: float) -> ObjectBelief:
    """A belief after a look: of a door half open, of furniture with a small deviation at home."""
    rng = np.random.default_rng(0)
    prior = filter_for(item, settings).prior(rng)
    if item.kind is Kind.PLANAR:
        spread = np.array([std_m, std_m, std_rad]) * rng.standard_normal((SAMPLES, 3))
        states = item.home + prior.std + spread
        return prior.with_samples(states, Weights.uniform(SAMPLES))
    std = std_m / (_length(item) / 2.0) if item.kind is Kind.HINGED else std_m
    off = (prior.states[:, 0] - prior.states[len(prior.states) // 2, 0]) / std
    return prior.with_weights(Weights.of(np.exp(-0.5 * off**2) + np.finfo(float).tiny))


def _length(item: MovableObject) -> float:
    """m, of a door's leaf."""
    near, far = leaf_ends(item)
    return round(float(np.hypot(*(far - near))), 6)
