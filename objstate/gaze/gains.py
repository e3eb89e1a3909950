"""What is gained of a belief by all that some looks tell of its object: eq. (6), Elfring et al. 2014."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from objstate.building.model import Kind
from objstate.gaze.entropy import sample_covariance
from objstate.gaze.laser import TEMPLATES, TINY, compared, evenly
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.particles import entropy

FAKES = 8  # states of a door's belief, each with an equal share, at which readings are faked

Gain = Callable[[FloatArray], float]


def gain_of(belief: ObjectBelief) -> Gain:
    """Conditions on a belief: gives the expected gain, nats, of what looks tell together.

    What looks tell comes as ``LaserLooks.look`` has it, added up over the looks.
    """
    return _of_furniture(belief) if belief.item.kind is Kind.PLANAR else _of_door(belief)


def _of_furniture(belief: ObjectBelief) -> Gain:
    """Of a Gaussian of the belief's covariance."""
    covariance = sample_covariance(belief.deviations, belief.weights.values)
    return lambda told: float(np.linalg.slogdet(np.eye(3) + covariance @ told)[1]) / 2.0


def _of_door(belief: ObjectBelief) -> Gain:
    """The mean over what the door may be.

    A state between two at which readings are faked takes those of the nearer, shifted. Between
    states that looks tell apart, log-likelihoods are linear.
    """
    prior, states = belief.weights.values, np.arange(len(belief.states))
    before, log = entropy(prior), np.log(prior + TINY)
    comb = (np.arange(FAKES) + 0.5) / FAKES
    fakes = np.searchsorted(np.cumsum(prior), comb).clip(max=states[-1])
    told_apart = compared(len(states))
    templates = told_apart[evenly(len(told_apart), TEMPLATES)]
    nearest = np.abs(templates - fakes[:, None]).argmin(axis=1)
    shifted = (states - (fakes - templates[nearest])[:, None]).clip(0, states[-1])
    place = np.interp(shifted, told_apart, np.arange(len(told_apart)))
    before_it = np.minimum(place.astype(np.int64), len(told_apart) - 2)
    share, row = place - before_it, nearest[:, None]

    def gain(told: FloatArray) -> float:
        posterior = log + (1.0 - share) * told[row, before_it] + share * told[row, before_it + 1]
        posterior -= posterior.max(axis=1, keepdims=True)
        weights = np.exp(posterior)
        total = weights.sum(axis=1)
        after = np.log(total) - (weights * posterior).sum(axis=1) / total  # Shannon's, of each fake
        return before - float(after.mean())

    return gain
