"""The expected gain of several looks at an object: eq. (6), Elfring et al. 2014."""

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
    """A function of the summed evidence of looks that gives the expected gain, nats.

    It is conditioned on a belief. The evidence is that of ``LaserLooks.look``, summed over the
    looks.
    """
    return _of_furniture(belief) if belief.item.kind is Kind.PLANAR else _of_door(belief)


def _of_furniture(belief: ObjectBelief) -> Gain:
    """Of a Gaussian of the belief's covariance."""
    covariance = sample_covariance(belief.deviations, belief.weights.values)
    return lambda told: float(np.linalg.slogdet(np.eye(3) + covariance @ told)[1]) / 2.0


def _of_door(belief: ObjectBelief) -> Gain:
    """The mean over the door's possible states.

    A state between two for which readings are simulated takes those of the nearer, shifted. Between
    compared states, log-likelihoods are interpolated.
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
