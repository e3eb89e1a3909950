"""Known furniture that looks alike, seen together: assignments, and probabilities of swaps.

Section III-E.3 of Elfring et al. 2012, with joint probabilistic data association in place of
k-means: each belief keeps all places at which its object may be, so that a swap is never ruled out
unless the places do so.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from objstate.association import marginals
from objstate.building.model import Kind
from objstate.errors import WorldError
from objstate.geometry import FloatArray
from objstate.maintenance.answers import LEAST_PRESENCE, Detection, log_density
from objstate.objects import ObjectBelief
from objstate.particles import Weights

TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Together:
    """The outcome of detections of objects that look alike."""

    beliefs: Mapping[str, ObjectBelief]
    chances: Mapping[str, FloatArray]  # (m + 1,) which detection is of an object; the last: none
    unswapped: float  # probability of the most probable assignment of detections to objects


def seen_together(
    beliefs: Mapping[str, ObjectBelief],
    seen: Sequence[Detection],
    in_sight: Mapping[str, float],
    new_per_m2: float = 0.01,
) -> Together:
    """Beliefs after one look that gave these detections.

    Args:
        beliefs: of furniture that looks alike, all at the moment of the look.
        seen: what was detected; new things and clutter among it.
        in_sight: by name, the probability that a look sees the object at its believed place.
        new_per_m2: expected density of unknown objects that look the same.

    Raises:
        WorldError: a door, or an object that is missing in ``in_sight``.
    """
    for name, belief in beliefs.items():
        if belief.item.kind is not Kind.PLANAR:
            raise WorldError(f"'{name}' is a door: it can't be taken for another one.")
        if not 0.0 <= in_sight.get(name, -1.0) <= 1.0:
            raise WorldError(f"in_sight has no probability for '{name}'; give one from 0 to 1.")
    densities = {
        name: np.array([np.exp(log_density(belief, d.mean, d.covariance)) for d in seen]).reshape(
            len(seen), len(belief.states)
        )
        for name, belief in beliefs.items()
    }
    scores = np.array(
        [
            _scores(belief, densities[name], seen, in_sight[name], new_per_m2)
            for name, belief in beliefs.items()
        ]
    )
    chances, best = marginals(scores)
    after = {
        name: _after(belief, densities[name], chance, in_sight[name])
        for (name, belief), chance in zip(beliefs.items(), chances, strict=True)
    }
    return Together(after, dict(zip(beliefs, chances, strict=True)), best)


def _scores(
    belief: ObjectBelief,
    densities: FloatArray,
    seen: Sequence[Detection],
    in_sight: float,
    new_per_m2: float,
) -> FloatArray:
    """(m + 1,) of each detection's being of an object rather than new or clutter; the last: not seen."""
    there = densities @ belief.weights.values  # (m,)
    clutter = np.array([each.clutter for each in seen])
    others = new_per_m2 / (2.0 * np.pi) / np.maximum(1.0 - clutter, TINY)
    detected = belief.presence * in_sight
    logs = np.log(np.maximum(detected * there / others, TINY))
    return np.append(logs, np.log(max(1.0 - detected, TINY)))


def _after(
    belief: ObjectBelief, densities: FloatArray, chances: FloatArray, in_sight: float
) -> ObjectBelief:
    """The belief as the mixture over what may have been of the object, each by its chance."""
    prior = belief.weights.values
    by_each = densities * prior
    by_each /= np.maximum(by_each.sum(axis=1, keepdims=True), TINY)
    missed, none = 1.0 - belief.presence * in_sight, chances[-1]
    left = belief.presence * (1.0 - in_sight) / missed if missed > 0.0 else 0.0
    presence = 1.0 - none + none * left
    places = chances[:-1] @ by_each + none * left * prior
    if presence < LEAST_PRESENCE:
        return replace(belief, presence=LEAST_PRESENCE, joint=None)
    after = belief.with_weights(Weights.of(places / presence))
    return replace(after, presence=presence, joint=None, last_observed_ns=belief.stamp_ns)
