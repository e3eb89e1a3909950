"""Answers of perception, as distributions (III-F of Elfring et al. 2012).

A *verification* has the coordinates of a known object, and updates these alone. A *falsification*
is the likelihood ratio of the object's absence, and lowers its presence. A *detection* has no
prior: it updates a known object, makes a new one, or is clutter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.building.shapes import Box
from objstate.errors import WorldError
from objstate.geometry import FloatArray, rotation_from_rpy, transform, wrap
from objstate.objects import ObjectBelief
from objstate.particles import Weights

LEAST_PRESENCE = 1e-6  # what is never ruled out: that it is there, or that it is gone
UNHEARD = 1e-3  # probability of a value that a distribution doesn't name
CLUTTER, NEW = "clutter", "new"

Discrete = Mapping[str, float]  # probabilities of an attribute's values, which sum to one


@dataclass(frozen=True, eq=False)
class Verification:
    """The measured state of a known object."""

    object: str
    mean: FloatArray  # (d,) m, rad
    covariance: FloatArray  # (d, d)
    attributes: Mapping[str, Discrete] = field(default_factory=dict)


@dataclass(frozen=True)
class Falsification:
    """Readings that are evidence for an object's absence."""

    object: str
    log_ratio: float  # log p(z | not there) - log p(z | there)


@dataclass(frozen=True, eq=False)
class Detection:
    """Something that was seen without knowing of it."""

    mean: FloatArray  # (3,) x, y, yaw
    covariance: FloatArray  # (3, 3)
    size: tuple[float, float, float]  # m, of a box about it
    attributes: Mapping[str, Discrete] = field(default_factory=dict)
    clutter: float = 0.05  # probability that it is a false positive


@dataclass(frozen=True)
class Association:
    """What a detection is of: probabilities by object's name, of ``NEW`` and of ``CLUTTER``."""

    probabilities: Mapping[str, float]

    @property
    def best(self) -> str:
        """The name of the most probable one."""
        return max(self.probabilities, key=lambda name: self.probabilities[name])


def verified(belief: ObjectBelief, measured: Verification) -> ObjectBelief:
    """The belief after its coordinates, and maybe attributes, were measured; presence stays.

    Raises WorldError for another object, or a measurement of another form.
    """
    _check(belief, measured.object)
    log = log_density(belief, measured.mean, measured.covariance)
    weights = Weights.of_logarithms(belief.weights.log + log)
    known = dict(belief.attributes)
    for name, values in measured.attributes.items():
        known[name] = combined(known[name], values) if name in known else dict(values)
    after = belief.with_weights(weights)
    return replace(after, attributes=known, joint=None, last_observed_ns=belief.stamp_ns)


def falsified(belief: ObjectBelief, answer: Falsification) -> ObjectBelief:
    """The belief after evidence for the object's absence; its coordinates are kept.

    Doors hang on their hinges and can't be falsified. Raises WorldError for one, and for another
    object.
    """
    _check(belief, answer.object)
    if belief.item.kind is not Kind.PLANAR:
        raise WorldError(f"'{answer.object}' is a door: it can be elsewhere, but not gone.")
    presence = min(max(belief.presence, LEAST_PRESENCE), 1.0 - LEAST_PRESENCE)
    odds = math.log(presence) - math.log1p(-presence) - answer.log_ratio
    most = math.log1p(-LEAST_PRESENCE) - math.log(LEAST_PRESENCE)
    after = 1.0 / (1.0 + math.exp(-min(max(odds, -most), most)))
    return replace(belief, presence=after, joint=None, last_observed_ns=belief.stamp_ns)


def associated(
    detection: Detection, beliefs: Mapping[str, ObjectBelief], new_per_m2: float = 0.01
) -> Association:
    """What a detection is of: known furniture, something new, or clutter.

    New objects are expected anywhere on the floor, with any heading, ``new_per_m2`` of them to the
    square metre. Attributes that both sides know count too.
    """
    new = new_per_m2 / (2.0 * math.pi)
    likelihoods = {NEW: new, CLUTTER: new * detection.clutter / (1.0 - detection.clutter)}
    for name, belief in beliefs.items():
        if belief.item.kind is Kind.PLANAR:
            density = np.exp(log_density(belief, detection.mean, detection.covariance))
            agrees = math.prod(
                agreement(belief.attributes[key], values)
                for key, values in detection.attributes.items()
                if key in belief.attributes
            )
            likelihoods[name] = belief.presence * agrees * float(belief.weights.values @ density)
    total = sum(likelihoods.values())
    return Association({name: value / total for name, value in likelihoods.items()})


def as_object(name: str, detection: Detection, count: int = 400, seed: int = 0) -> ObjectBelief:
    """The belief of a new object: a box where it was detected, there unless it was clutter."""
    lifted = transform(np.eye(3), np.array([0.0, 0.0, detection.size[2] / 2.0]))
    box = Box(detection.size).mesh().moved(lifted)
    x, y, yaw = detection.mean.tolist()
    origin = transform(rotation_from_rpy(0.0, 0.0, yaw), np.array([x, y, 0.0]))
    item = MovableObject(name, Kind.PLANAR, origin, np.array([0.0, 0.0, 1.0]), 0.0, 0.0, box)
    rng = np.random.default_rng(seed)
    states = rng.multivariate_normal(detection.mean, detection.covariance, count)
    states[:, 2] = wrap(states[:, 2])
    return ObjectBelief(
        item,
        states,
        Weights.uniform(count),
        np.zeros(3),
        1.0 - detection.clutter,
        attributes=detection.attributes,
    )


def combined(known: Discrete, measured: Discrete) -> dict[str, float]:
    """Bayes' rule for an attribute: the product of two distributions, over all their values."""
    names = dict.fromkeys((*known, *measured))
    product = {n: known.get(n, UNHEARD) * measured.get(n, UNHEARD) for n in names}
    total = sum(product.values())
    return {name: value / total for name, value in product.items()}


def agreement(known: Discrete, measured: Discrete) -> float:
    """Likelihood ratio of a measured attribute: of this object to any, with equal values."""
    names = dict.fromkeys((*known, *measured))
    same = sum(known.get(n, UNHEARD) * measured.get(n, UNHEARD) for n in names)
    return len(names) * same


def log_density(belief: ObjectBelief, mean: FloatArray, covariance: FloatArray) -> FloatArray:
    """(n,) log N(mean; s, covariance) of a belief's states. Raises WorldError."""
    d = belief.states.shape[1]
    if mean.shape != (d,) or covariance.shape != (d, d):
        raise WorldError(
            f"A measurement of '{belief.item.name}' needs a mean ({d},) and a covariance "
            f"({d}, {d}), not {mean.shape} and {covariance.shape}."
        )
    states = belief.states
    if belief.item.kind is Kind.PLANAR:
        states = belief.item.symmetry.nearest(states, float(mean[2]))
    off = states - mean
    off = np.where(belief.wraps, wrap(off), off)
    squared = (off * np.linalg.solve(covariance, off.T).T).sum(axis=1)
    return np.asarray(-0.5 * (squared + np.linalg.slogdet(2.0 * np.pi * covariance)[1]))


def _check(belief: ObjectBelief, name: str) -> None:
    if belief.item.name != name:
        raise WorldError(f"An answer about '{name}' can't update '{belief.item.name}'.")
