"""Beliefs made with other settings, brought to the samples that a filter works with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief, ObjectFilter
from objstate.objects.furniture import SampleFilter
from objstate.particles import Weights, systematic


def fitted(belief: ObjectBelief, by: ObjectFilter, rng: np.random.Generator) -> ObjectBelief:
    """The belief on the samples of a filter; itself where it has such samples already."""
    if isinstance(by, SampleFilter):
        return _with_samples(belief, by, rng)
    prior = by.prior(rng)
    on_lattice = replace(belief, states=prior.states, cell=prior.cell)
    if np.array_equal(belief.states, prior.states):
        return on_lattice
    return on_lattice.with_weights(_spread(belief, prior.states))


def _spread(belief: ObjectBelief, states: FloatArray) -> Weights:
    """The weights of a lattice's ``states`` (n, 1) when another one's density is read off at them."""
    item = belief.item
    period = item.upper - item.lower if item.wraps else None
    density = np.interp(states[:, 0], belief.states[:, 0], belief.weights.values, period=period)
    return Weights.of(density + np.finfo(float).tiny)


def _with_samples(belief: ObjectBelief, by: SampleFilter, rng: np.random.Generator) -> ObjectBelief:
    """Samples resampled to the filter's number, with new scouts behind them."""
    s = by.settings
    if (
        belief.scouts == s.scouts
        and len(belief.states) <= max(s.samples, s.first_samples) + s.scouts
    ):
        return belief
    known = belief.standing
    chosen = known.states[systematic(known.weights, s.samples, rng)]
    scouts = by.prior(rng).states[s.first_samples :]
    shares = np.append(
        np.full(s.samples, (1.0 - s.scout_weight) / s.samples),
        np.full(s.scouts, s.scout_weight / s.scouts),
    )
    states = np.concatenate([chosen, scouts])
    return replace(belief, states=states, weights=Weights.of(shares), scouts=s.scouts)
