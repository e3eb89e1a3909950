"""Beliefs made with other settings, brought to the states that a filter works with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.building.model import Kind
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief, ObjectFilter
from objstate.particles import Weights


def fitted(belief: ObjectBelief, by: ObjectFilter, rng: np.random.Generator) -> ObjectBelief:
    """The belief on the lattice of a filter; itself where it has such states already, or free samples."""
    if belief.item.kind is Kind.PLANAR:
        return belief
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
